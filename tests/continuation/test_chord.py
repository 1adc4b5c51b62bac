"""One factorization a step: the same branches, tangents and special points, with less factoring."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, EULER_LOADS, bratu, elastica, kinds, phase_separation

from rodatlas.continuation import BVP, Branch, MeshControl, NewtonOptions, Solution, TraceOptions, switch, trace
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices


def traced(bvp: BVP, free: tuple[str, ...], chord: bool, **options) -> Branch:
    zero = Solution.from_function(lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, bvp.parameters)
    return trace(bvp, zero, free, TraceOptions(newton=NewtonOptions(chord=chord), **options))


def test_fold_of_bratu() -> None:
    branch = traced(bratu(), ("lam",), True, bounds={"lam": (0.0, 4.0), "mean": (-1.0, 4.0)})
    assert kinds(branch) == ["fold"]
    assert branch.special[0].solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-10)


def test_buckling_loads() -> None:
    options = {"bounds": {"P": (1.0, 260.0)}, "mesh": MeshControl(tolerance=1e-11)}
    column = traced(elastica(), ("P", "V"), True, **options)
    np.testing.assert_allclose([x.solution["P"] for x in column.special], EULER_LOADS, rtol=0, atol=1e-8)


@pytest.mark.parametrize("chord", [False, True])
def test_a_closed_branch_with_four_folds(chord: bool) -> None:
    bvp = phase_separation()
    options = TraceOptions(newton=NewtonOptions(chord=chord), mesh=MeshControl(tolerance=1e-10))
    zero = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    uniform = trace(bvp, zero, ("m", "mu"), TraceOptions(bounds={"m": (-1.0, 1.0)}))
    front = switch(bvp, uniform.special[-1], ("m", "mu"), options)
    assert front is not None
    assert front.closed
    folds = [abs(x.solution["m"]) for x in front.of_kind("fold")]
    assert len(folds) == 4
    np.testing.assert_allclose(folds, folds[0], atol=1e-8)


def test_tangents_and_test_functions_are_those_of_newton() -> None:
    """At the points themselves: factors of a predicted point would be off by a hundredth."""
    bvp = bratu()
    branch = traced(bvp, ("lam",), True, bounds={"lam": (0.0, 4.0), "mean": (-1.0, 3.0)}, locate=())
    for point in branch.points[1:]:
        colloc = Collocation.at(bvp, point.solution, free_indices(bvp, ("lam",)), Scale(np.ones(2), np.ones(1)))
        x = colloc.state(point.solution)
        rows = [colloc.observable_row("lam", x)[1]]
        fac = colloc.factor(colloc.linearize(x), rows)
        v = fac.solve(colloc.right_hand_side(None, rows, [1.0]))
        assert abs(point.tangent[0]) == pytest.approx(abs(v.scalars[0]) / colloc.norm(v), abs=1e-5)


def counted(monkeypatch: pytest.MonkeyPatch, run: Callable[[], Branch]) -> tuple[Branch, int]:
    """A run, and how many matrices it factored."""
    count, factor = [0], Collocation.factor

    def counting(self, *args, **kwargs):
        count[0] += 1
        return factor(self, *args, **kwargs)

    with monkeypatch.context() as patch:
        patch.setattr(Collocation, "factor", counting)
        return run(), count[0]


def test_factors_once_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a mesh of fixed size nothing else is factored along the way; a start and the last point take a dozen."""

    def run(chord: bool) -> Branch:
        options = {"bounds": {"lam": (0.0, 3.0)}, "mesh": MeshControl(intervals=(30, 30)), "locate": ()}
        return traced(bratu(), ("lam",), chord, **options)

    newton, often = counted(monkeypatch, lambda: run(False))
    chord, seldom = counted(monkeypatch, lambda: run(True))
    assert len(newton) == len(chord)
    assert seldom <= len(chord) + 12
    assert often >= 2 * len(newton)
    np.testing.assert_allclose(chord.column("lam"), newton.column("lam"), atol=1e-5)  # predicted a little apart


def test_chord_is_true_or_false() -> None:
    with pytest.raises(ValueError, match="chord: expected True or False, got 1"):
        NewtonOptions(chord=1)  # type: ignore[arg-type]
