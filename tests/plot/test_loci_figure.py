"""The figure of loci: for which band it holds, what its axes measure, and what lines and marks mean."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.legend import Legend

from rodatlas.paper.model import band_loci
from rodatlas.plot import draw_loci, draw_loci_figure
from rodatlas.plot.look.style import new_figure
from rodatlas.plot.planes.loci import LINES


def piece(number, kind, left, right, curve, events=()):
    angles = np.linspace(0.0, 60.0, 15)
    places = np.column_stack([angles, left + (right - left) * angles / 60.0, 0.0 * angles])
    return SimpleNamespace(number=number, kind=kind, places=places, curve=curve, events=events)


@pytest.fixture(scope="module")
def loci():
    """Pitchfork 4, fold 12 that starts from a point of it, and the rest of the curve of 12."""
    turn = SimpleNamespace(kind="criticality", parameter="psi0")
    lowest = SimpleNamespace(kind="extremum", parameter="dD")
    events = (
        SimpleNamespace(event=turn, second=30.0, value=0.325),
        SimpleNamespace(event=lowest, second=45.0, value=0.34),
    )
    pieces = (
        piece(4, "pitchfork", 0.3, 0.35, 0, events), piece(12, "fold", 0.5, 0.45, 1),
        piece(None, "fold", 0.6, 0.7, 1), piece(3, "pitchfork", 0.1, 0.1, 2),
    )  # fmt: skip
    return SimpleNamespace(settings=band_loci(compression=0.45, poisson=0.3), pieces=pieces)


def meanings(ax):
    return {t.get_text() for legend in ax.findobj(Legend) for t in legend.get_texts()}


def test_the_setting_units_and_meanings_are_told(loci):
    ax = draw_loci(loci, (4, 12))
    assert ax.get_title("left") == r"$\Delta L=0.45\,L$,  $\nu=0.3$"
    assert ax.get_xlabel() == r"clamp angle $\psi_0$  (degrees)"
    assert ax.get_ylabel() == r"shear $\Delta D$  (units of $L$)"
    assert meanings(ax) == {"fold", "pitchfork", "rest of the curve", "super-/subcritical"}
    assert {t.get_text() for t in ax.texts if t.get_text()} == {"4", "12"}


def test_only_what_is_asked_for_is_in_color(loci):
    def thick(numbers):
        curves = [x for x in draw_loci(loci, numbers).lines if x.get_linestyle() != "None"]
        return sum(x.get_linewidth() > 1.0 for x in curves)

    assert (thick(()), thick((4,))) == (3, 1)
    assert "rest of the curve" not in meanings(draw_loci(loci, (4,)))


def test_numbers_stand_on_their_curves(loci):
    ax = draw_loci(loci)
    for label in (t for t in ax.texts if t.get_text()):
        on = next(p for p in loci.pieces if str(p.number) == label.get_text())
        angle, shear = label.get_position()
        expected = np.interp(angle, on.places[:, 0], on.places[:, 1])
        assert shear == pytest.approx(expected, abs=1e-3)
        assert label.get_color() == LINES[on.kind]["color"]


def test_draws_on_given_axes_or_a_figure(loci):
    ax = new_figure(4.0, 3.0).add_subplot()
    assert draw_loci(loci, ax=ax) is ax
    assert len(draw_loci_figure(loci).axes) == 1
