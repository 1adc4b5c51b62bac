"""AUTO-07p's demo `int`, boundary and integral conditions: u'' + lam exp(u) = 0, u(0) - u(1) = a, int u = b.

    python examples/auto_int.py

For a = 0 the states are Bratu's, shifted by a constant: lam = L exp(M - b) with L = t^2 / (2 cosh(t/4)^2) and M the
mean of Bratu's solution with this t. So the fold over t is found in one dimension, and depends on b like exp(-b).
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Locus, Solution, TraceOptions, end_value, follow_locus, trace


def problem() -> BVP:
    """Two unknowns, one boundary and one integral condition: one free parameter."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u)},
        lambda left, right, p: [left.u - right.u - p.a],
        lambda s, u, p: u.u - p.b,
        unknowns=("u", "v"),
        parameters={"lam": 0.0, "a": 0.0, "b": 0.0},
        observables={"slope": end_value(lambda left, right, p: left.v)},
    )


def main() -> tuple[Branch, Locus]:
    """The branch with mean zero around its fold, and the locus of the fold in lam and b."""
    bvp = problem()
    zero = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, zero, ("lam",), TraceOptions(bounds={"lam": (0.0, 20.0), "slope": (-1.0, 30.0)}))
    print(branch)
    fold = branch.of_kind("fold")[0]
    print(f"fold at lam = {fold.solution['lam']:.10f}, u'(0) = {fold.solution['slope']:.8f}")
    locus = follow_locus(bvp, fold, ("lam", "b"), TraceOptions(bounds={"b": (-1.0, 1.0)}))
    print(locus)
    return branch, locus


if __name__ == "__main__":
    main()
