"""What all drawing functions have in common: the order of their arguments, what they return, and how files appear."""

import importlib
import inspect
import pkgutil
import subprocess
import sys
import time

import numpy as np
import pytest

import rodatlas.plot
from rodatlas.continuation import Solution
from rodatlas.paper import band
from rodatlas.plot import draw_triad, render_band, save_figure
from rodatlas.plot.look.heading import setting_of, setting_text
from rodatlas.plot.look.style import new_figure
from rodatlas.rods import Ends, state_at

PREFIXES = ("draw_", "label_", "render_")
PUBLIC = [name for name in rodatlas.plot.__all__ if name.startswith(("draw_", "render_"))]


def drawing_functions():
    """Every function of the package that draws, those of figures in the modules and parts of figures included."""
    found = {}
    for module in pkgutil.walk_packages(rodatlas.plot.__path__, "rodatlas.plot."):
        for name, value in vars(importlib.import_module(module.name)).items():
            draws = name.lstrip("_").startswith(PREFIXES) and name != "label_of"
            if inspect.isfunction(value) and value.__module__ == module.name and draws:
                found[f"{module.name}.{name}"] = value
    return found


@pytest.mark.parametrize("name", PUBLIC)
def test_public_functions_return_the_axes_given_or_a_figure(name):
    function = getattr(rodatlas.plot, name)
    parameters = inspect.signature(function).parameters
    returned = inspect.signature(function).return_annotation
    if "ax" in parameters:
        assert returned == "Axes"
        assert parameters["ax"].default is None
    else:
        assert returned == "Figure"


@pytest.mark.parametrize("name", drawing_functions())
def test_what_is_drawn_comes_first_and_axes_last(name):
    parameters = inspect.signature(drawing_functions()[name]).parameters.values()
    usual = [p.name for p in parameters if p.kind is inspect.Parameter.POSITIONAL_OR_KEYWORD]
    if "ax" in usual:
        assert usual[-1] == "ax"
        assert usual[0] != "ax" or len(usual) == 1
    assert "axes" not in usual
    assert "fig" not in usual[:1]


@pytest.fixture(scope="module")
def solution():
    return state_at(Ends(45.0, shear=0.2))


def test_drawings_make_a_figure_of_their_own(solution):
    for ax in (render_band(solution), draw_triad()):
        assert len(ax.figure.axes) == 1
        box = ax.get_window_extent()
        aspect = np.ptp(ax.get_ylim()) / np.ptp(ax.get_xlim())
        assert box.height / box.width == pytest.approx(aspect, rel=1e-6)


def test_settings_are_told_with_their_units(solution):
    assert band().control("angle").equation(27.5) == r"\psi_0=27.5^\circ"
    assert band().control("shear").equation(-1e-17) == r"\Delta D=0\,L"
    values = {"poisson": 0.25, "compression": 0.5, "shear": 0.0}
    assert setting_text(band().controls, values) == r"$\Delta L=0.5\,L$,  $\nu=0.25$"
    assert setting_of(solution) == r"$\Delta D=0.2\,L$,  $\psi_0=45^\circ$,  $\Delta L=0.5\,L$,  $\nu=0.25$"
    assert "psi" not in setting_of(solution, without=("angle",))
    assert isinstance(solution, Solution)


def figure(shade):
    fig = new_figure(2.0, 2.0)
    fig.add_subplot().imshow(np.full((40, 40), shade), vmin=0.0, vmax=1.0)
    return fig


SAVE_FOR_EVER = """
import sys
from rodatlas.plot import save_figure
from rodatlas.plot.look.style import new_figure
fig = new_figure(2.0, 2.0)
fig.add_subplot().plot([0.0, 1.0], [0.0, float(sys.argv[2])])
while True:
    save_figure(fig, sys.argv[1])
"""


def whole(path):
    data = path.read_bytes()
    if path.suffix == ".png":
        return data.startswith(b"\x89PNG") and data.rstrip().endswith(b"IEND\xaeB`\x82")
    return data.startswith(b"%PDF") and data.rstrip().endswith(b"%%EOF")


@pytest.mark.slow
def test_no_reader_and_no_kill_meets_half_a_figure(tmp_path):
    """Two processes write the same figure while it is read, and are killed in the middle of it."""
    written = save_figure(figure(0.1), tmp_path / "same")
    seen = {written[0].read_bytes()}
    command = [sys.executable, "-c", SAVE_FOR_EVER, str(tmp_path / "same")]
    writers = [subprocess.Popen([*command, slope]) for slope in ("1.0", "2.0")]
    end = time.monotonic() + 120.0
    try:
        while len(seen) < 3 and time.monotonic() < end:
            assert all(whole(path) for path in written)
            seen.add(written[0].read_bytes())
    finally:
        for writer in writers:
            writer.kill()
            writer.wait()
    assert len(seen) == 3  # the first, and those of both writers
    assert all(whole(path) for path in written)
    assert {p.name for p in tmp_path.iterdir() if not p.name.startswith(".")} == {"same.png", "same.pdf"}


def test_a_figure_that_cannot_be_written_leaves_the_older_one(tmp_path, monkeypatch):
    png, pdf = save_figure(figure(0.1), tmp_path / "kept")
    before = png.read_bytes(), pdf.read_bytes()
    broken = figure(0.5)
    monkeypatch.setattr(broken, "savefig", lambda *args, **options: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        save_figure(broken, tmp_path / "kept")
    assert (png.read_bytes(), pdf.read_bytes()) == before
    assert {p.name for p in tmp_path.iterdir()} == {"kept.png", "kept.pdf"}
    with pytest.raises(OSError, match=r"missing"):
        save_figure(figure(0.1), tmp_path / "missing" / "there")
