"""Figures of branches and loci of any problem: what is stable, what marks mean, and that the curve is the right one."""

from __future__ import annotations

import numpy as np
import pytest

from rodatlas.continuation import BVP, Solution, TraceOptions, end_value, follow_locus, trace
from rodatlas.plot import draw_branch, draw_locus


def problem() -> BVP:
    """x^2 + lam^2 + mu^2 = 1, constant in s."""
    return BVP(
        lambda s, u, p: [0.0 * u.x], lambda left, right, p: [left.x**2 + p.lam**2 + p.mu**2 - 1],
        unknowns=("x",), parameters={"lam": 0.0, "mu": 0.0}, observables={"x0": end_value(lambda l, r, p: l.x)},
    )  # fmt: skip


@pytest.fixture(scope="module")
def branch():
    """The circle, stable where x > 0."""
    start = Solution.from_function(lambda s: np.full((len(s), 1), 0.8), ("x",), {"lam": 0.6, "mu": 0.0})
    options = TraceOptions(index=lambda s: int(s["x0"] < 0), extrema=("x0",), zeros={"lam": 0.5})
    return trace(problem(), start, ("lam",), options)


@pytest.fixture(scope="module")
def locus(branch):
    return follow_locus(problem(), branch.of_kind("fold")[0], ("lam", "mu"))


def lines(ax):
    return [line for line in ax.lines if len(line.get_xdata()) > 1]


def marks(ax):
    return [line for line in ax.lines if len(line.get_xdata()) == 1]


def test_a_branch_in_one_call(branch) -> None:
    ax = branch.plot("lam", "x0")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("lam", "x0")
    for line in lines(ax):
        x, y = line.get_data()
        np.testing.assert_allclose(np.hypot(x, y), 1.0, atol=2e-4)
        dashed = line.get_linestyle() != "-"
        assert (y < 1e-3).all() if dashed else (y > -1e-3).all()  # cut at the folds
    assert [line.get_linestyle() for line in lines(ax)] == ["-", "--", "-"]
    drawn = sorted((m.get_marker(), m.get_markerfacecolor()) for m in marks(ax))
    assert [d for d in drawn if d[0] == "o"] == [("o", "white")] * 2
    assert [d[0] for d in drawn] == ["^", "^", "o", "o", "|", "|"]


def test_without_an_index_all_is_solid_and_one_line(branch) -> None:
    start = branch.points[0].solution
    plain = trace(problem(), start, ("lam",), TraceOptions(bounds={"x0": (0.1, 2.0)}))
    ax = plain.plot("lam", "x0", color="#860228")
    (line,) = lines(ax)
    assert (line.get_linestyle(), line.get_color()) == ("-", "#860228")
    assert plain.plot("arclength", "lam", ax=ax) is ax
    assert len(lines(ax)) == 2


def test_a_locus_in_one_call(locus) -> None:
    ax = locus.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("mu", "lam")
    (line,) = lines(ax)
    np.testing.assert_allclose(np.hypot(*line.get_data()), 1.0, atol=2e-4)
    words = [t.get_text() for t in ax.get_legend().get_texts()]
    assert words == ["fold", "extremum"]
    locus.plot(ax=ax)
    assert [t.get_text() for t in ax.get_legend().get_texts()] == words


def test_wrong_names_and_things_are_told(branch, locus) -> None:
    with pytest.raises(ValueError, match="x, y: expected one of lam, mu, x0, arclength, got 'height'"):
        branch.plot("lam", "height")
    with pytest.raises(ValueError, match="branch: expected a Branch"):
        draw_branch(locus, "lam", "x0")
    with pytest.raises(ValueError, match="locus: expected a Locus"):
        draw_locus(branch)
    with pytest.raises(ValueError, match="ax: expected axes of matplotlib"):
        branch.plot("lam", "x0", ax=3)
