"""Diagrams of slices that are not those of the paper: other controls and quantities, names and colors, no shapes."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rodatlas.atlas import SliceSettings, compute_slice
from rodatlas.continuation import Solution
from rodatlas.model import Control, Model, Quantity, Seed, Source
from rodatlas.model.nomenclature import PALETTE
from rodatlas.plot import colors_of, draw_slice, draw_slice_figure
from rodatlas.plot.exports import slice_tables
from rodatlas.plot.slices.curves import slice_stretches, unique_events

ARCH = runpy.run_path(str(Path(__file__).parents[2] / "examples/arch.py"))


def unloaded(setting, tolerance, keep):
    problem = ARCH["arch"]()
    return [Seed("unloaded", Solution.from_function(ARCH["unloaded"], problem.unknowns, problem.parameters))], []


def stable_outside(solution):
    """The index of the arch's symmetric branch by its closed form: folds where a^2 = (h^2 - 1)/3."""
    return 0 if solution["a"] ** 2 > 5.0 else 1


@pytest.fixture(scope="module")
def arch():
    model = Model(
        "arch", ARCH["arch"],
        (Control("rise", "h", "h", 3.0, usual=lambda at: (0.5, 4.0)),
         Control("load", "q", r"q/\pi^4", 0.0, scale=np.pi**-4, usual=lambda at: (-6.0, 15.0))),
        (Quantity.of("a", what="amplitude"),), (Source("unloaded", unloaded),), free=("N",), index=stable_outside,
    )  # fmt: skip
    return compute_slice(SliceSettings.of(model))


def test_a_problem_without_a_shape_has_its_diagram_alone(arch):
    figure = draw_slice_figure(arch)
    (ax,) = figure.axes
    assert ax.get_title("left") == "$h=3$"
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"load $q/\pi^4$", r"amplitude $\mathrm{a}$")
    stable = [line for line in ax.lines if line.get_gid() == "stable"]
    names = list(dict.fromkeys(s.name for s in arch.states))
    assert {line.get_color() for line in stable} == set(PALETTE[: len(names)])
    assert set(names) <= {t.get_text() for t in ax.texts}
    assert len(draw_slice(arch).lines) == len(ax.lines)


def test_values_are_those_of_the_user(arch):
    """Loads in units of pi^4; folds at h -+ 2 (8/3)^(3/2), a^2 = 8/3."""
    folds = sorted({e.place for e in unique_events(arch) if e.kind == "fold"})
    assert np.allclose([x for x, _ in folds], [3 - 2 * (8 / 3) ** 1.5, 3 + 2 * (8 / 3) ** 1.5], atol=1e-6)
    assert np.allclose([abs(y) for _, y in folds], (8 / 3) ** 0.5, atol=1e-6)
    table = slice_tables(arch)["branches"]
    points = table[table["branch"] == "unloaded"]
    assert "q" not in table
    assert (points["load"].min(), points["load"].max()) == pytest.approx((-6.0, 15.0))


def test_a_curve_that_goes_back_on_itself_is_drawn_once(arch):
    """Each side branch leads from pitchfork to pitchfork and back as its mirror image, of the same amplitude."""
    ax = draw_slice(arch)
    heights = [line.get_ydata() for line in ax.lines if line.get_gid() == "unstable"]
    assert sum(int(((y[:-1] < 0.3) != (y[1:] < 0.3)).sum()) for y in heights) == 2  # each branch once


def test_members_of_a_pair_with_other_responses_have_a_curve_each(near_zero):
    """The force across the clamp plane changes its sign with the reversal, the height does not."""
    across = replace(near_zero, settings=replace(near_zero.settings, against="force-y"))
    for slice_, count in ((near_zero, 1), (across, 2)):
        curves = [s for s in slice_stretches(slice_) if s.name == "TU+-"]
        assert len(curves) == count
    one, two = (s.xy for s in slice_stretches(across) if s.name == "TU+-")
    assert np.abs(one[:, 1]).max() > 0.1
    assert np.allclose(one[:, 0], two[:, 0], atol=1e-9)
    assert np.allclose(one[:, 1], -two[:, 1], atol=1e-4)  # solutions are good to 1e-6
    assert len(unique_events(across)) >= len(unique_events(near_zero))


def test_colors_follow_the_nomenclature_where_it_names_the_states(near_zero):
    named = colors_of(near_zero)
    assert named["U"] == PALETTE[0]
    assert named["TU+-"] != named["W"]
    other = replace(near_zero, settings=near_zero.settings.at(offset=0.1))
    assert list(colors_of(other)) == ["U", "W", "TU+-", "TW+-"]  # by order: nobody knows these names there
    assert list(colors_of(other).values()) == list(PALETTE[:4])
