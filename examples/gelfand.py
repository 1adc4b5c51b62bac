"""Thermal ignition, u'' + lam exp(u/(1 + eps u)) = 0 with u(0) = u(1) = 0: two folds that meet in a cusp.

    python examples/gelfand.py

This is the perturbed Gelfand problem. For eps = 0 it is Bratu's, with one fold at lam = 3.513830719. At eps = 0.2 there
are two, ignition and extinction; they meet and vanish at eps = 0.2457803.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Locus, Solution, TraceOptions, follow_locus, integral_of, trace


def gelfand(eps: float = 0.2) -> BVP:
    """Temperature u and its slope v; eps is the inverse activation energy."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u / (1 + p.eps * u.u))},
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 0.0, "eps": eps},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )


def main() -> tuple[Branch, Locus]:
    """The S-shaped branch at eps = 0.2, and the locus of its folds in the plane of lam and eps."""
    bvp = gelfand()
    cold = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, cold, ("lam",), TraceOptions(bounds={"lam": (0.0, 6.0), "mean": (-1.0, 20.0)}))
    for fold in branch.of_kind("fold"):
        print(f"fold at lam = {fold.solution['lam']:.9f}, mean = {fold.solution['mean']:.6f}")
    bounds = {"eps": (0.0, 0.3), "lam": (1.0, 6.0)}
    locus = follow_locus(bvp, branch.of_kind("fold")[0], ("lam", "eps"), TraceOptions(bounds=bounds))
    print(locus)
    for event in locus.events:
        print(f"{event.kind} at eps = {event.solution['eps']:.8f}, lam = {event.solution['lam']:.8f}: {event.what}")
    return branch, locus


if __name__ == "__main__":
    main()
