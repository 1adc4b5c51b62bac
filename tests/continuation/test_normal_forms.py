"""Reduced coefficients at special points, against curves known on paper."""

from __future__ import annotations

import numpy as np
import pytest
from bvp_problems import algebraic, bratu, constant, elastica

from rodatlas.continuation import BVP, Branch, Solution, StepControl, TraceOptions, follow_locus, switch, trace


def special(bvp, low=-1.0, high=1.0, start=None, **options):
    settings = TraceOptions(bounds={"lam": (low, high)}, **options)
    return trace(bvp, constant(bvp, start, lam=low), ("lam",), settings, both=False).special


@pytest.mark.parametrize("c", [3.0, -0.5])
def test_pitchfork(c):
    """x (lam - c x^2): the side branch is lam = c x^2."""
    (point,) = special(algebraic(lambda u, p: [u.x * (p.lam - c * u.x**2)]))
    assert point.normal_form.kind == "pitchfork"
    assert point.normal_form.slope == 0.0
    assert point.normal_form.bend == pytest.approx(2 * c, rel=1e-8)
    assert point.criticality == ""  # without an index nobody knows


def test_transcritical():
    """x (lam - 2 x - 3 x^2): the other branch lam = 2 x + 3 x^2, at unit speed lam' = 2/sqrt(5), lam'' = 6/25."""
    (point,) = special(algebraic(lambda u, p: [u.x * (p.lam - 2 * u.x - 3 * u.x**2)]))
    assert point.normal_form.kind == "transcritical"
    assert abs(point.normal_form.slope) == pytest.approx(2 / 5**0.5, rel=1e-8)
    assert point.normal_form.bend == pytest.approx(6 / 25, rel=1e-7)


def test_pitchfork_with_a_passive_unknown():
    """x (lam - y), y = x^2 + 5 x^4: what follows x passively counts: lam = x^2, not zero."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.y), u.y - u.x**2 - 5 * u.x**4], unknowns=("x", "y"))
    (point,) = special(bvp)
    assert point.normal_form.bend == pytest.approx(2.0, rel=1e-8)


def test_pitchfork_met_along_its_side_branch():
    bvp = algebraic(lambda u, p: [u.x * (p.lam - 3 * u.x**2)])
    branch = trace(bvp, constant(bvp, [0.5], lam=0.75), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}))
    (point,) = branch.special
    assert point.turns
    assert point.normal_form.kind == "pitchfork"
    assert point.normal_form.bend == pytest.approx(6.0, rel=1e-6)


@pytest.mark.parametrize(("c", "after", "expected"), [
    (1.0, 1, "supercritical"), (-1.0, 1, "subcritical"), (1.0, -1, "subcritical"),
])  # fmt: skip
def test_criticality_needs_the_index(c, after, expected):
    bvp = algebraic(lambda u, p: [u.x * (p.lam - c * u.x**2)])
    points = special(bvp, index=lambda s: 1 + (after if s["lam"] > 0 else 0))
    assert [p.criticality for p in points] == [expected]


def test_fold():
    """Bratu's fold: lam = lam0 + bend a^2/2 along the branch."""
    branch = trace(bratu(), constant(bratu()), ("lam",),
                   TraceOptions(bounds={"mean": (0.0, 2.0)}, step=StepControl(maximum=0.05)), both=False)  # fmt: skip
    (fold,) = branch.of_kind("fold")
    s, lam = branch.column("arclength") - fold.arclength, branch.column("lam")
    near = np.abs(s) < 0.6
    fit = np.polynomial.polynomial.polyfit(s[near], lam[near] - fold.solution["lam"], 5)
    assert fold.normal_form.kind == "fold"
    assert fold.normal_form.bend == pytest.approx(2 * fit[2], rel=1e-3)
    assert fold.normal_form.bend < 0


def test_buckling_load_rises_as_on_paper():
    """P = 4 pi^2 (1 + k^2/8 + ...) where the slope of the clamped elastica has amplitude k, and P sets the scale."""
    column = trace(elastica(), constant(elastica()), ("P", "V"), TraceOptions(bounds={"P": (0.0, 60.0)}), both=False)
    (point,) = column.special
    d = point.directions[1]
    theta = abs(d.mesh[0, 2]) * point.scale.unknowns[2] / (2 * np.pi)  # slope amplitude, from the curvature at an end
    assert point.normal_form.kind == "pitchfork"
    assert point.normal_form.bend == pytest.approx(2 * 4 * np.pi**2 * theta**2 / 8, rel=1e-5)


def test_prediction_of_the_side_branch_is_of_third_order():
    """The first point after a switch is predicted with an error that falls eightfold when the step is halved."""
    column = trace(elastica(), constant(elastica()), ("P", "V"), TraceOptions(bounds={"P": (0.0, 60.0)}), both=False)
    point, errors = column.special[0], []
    for step in (0.08, 0.04):
        branch = switch(elastica(), point, ("P", "V"), TraceOptions(max_points=2), first_step=step)
        found = branch.points[1].solution
        errors.append(abs(found["P"] - point.solution["P"] - point.normal_form.bend * step**2 / 2))
    assert errors[1] < errors[0] / 12  # even in the step: the next term is of fourth order


def test_cusp():
    """lam + 2 mu x + 3 lam x + x^3."""
    bvp = algebraic(lambda u, p: [p.lam + 2 * p.mu * u.x + 3 * p.lam * u.x + u.x**3], parameters=("lam", "mu"))
    branch = trace(bvp, constant(bvp, [1.0], mu=-0.5), ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}))
    locus = follow_locus(bvp, branch.of_kind("fold")[0], ("lam", "mu"), TraceOptions(bounds={"mu": (-1.0, 1.0)}))
    (cusp,) = locus.of_kind("cusp")
    form = cusp.coefficients
    assert abs(form["cubic"]) == pytest.approx(6.0, rel=1e-6)
    assert abs(form["constant lambda"]) == pytest.approx(1.0, rel=1e-6)
    assert form["constant mu"] == pytest.approx(0.0, abs=1e-6)
    assert form["linear mu"] / form["cubic"] == pytest.approx(2 / 6, rel=1e-6)


def test_normal_forms_are_saved(tmp_path):
    bvp = BVP(
        lambda s, u, p: [u.v, -(np.pi**2 + p.lam) * u.u + u.u**3], lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": -1.0},
    )  # fmt: skip
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 1.0)}), both=False)
    branch.save(tmp_path / "b.h5")
    (old,), (new,) = branch.special, Branch.load(tmp_path / "b.h5").special
    assert old.normal_form == new.normal_form
    # u'' + pi^2 u + lam u = u^3 with u = A sin: lam = 3/4 A^2
    assert old.normal_form.kind == "pitchfork"
    np.testing.assert_array_equal(old.bend.stage, new.bend.stage)
    assert np.all([len(x.directions) == 2 for x in (old, new)])
