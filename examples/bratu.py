"""Bratu's problem u'' + lam exp(u) = 0, u(0) = u(1) = 0: up to the fold and down the upper branch.

python examples/bratu.py
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, integral_of, trace


def bratu() -> BVP:
    """The problem as two equations of first order."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u)},
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )


def main() -> Branch:
    """Follow the solutions from u = 0 at lam = 0 until their mean is 4."""
    bvp = bratu()
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, {"lam": 0.0})
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (0.0, 4.0), "mean": (-1.0, 4.0)}))
    print(branch)
    for special in branch.special:
        print(f"{special.kind} at lam = {special.solution['lam']:.12f} ({special.status.value})")
    return branch


if __name__ == "__main__":
    main()
