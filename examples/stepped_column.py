"""A pinned column that is four times as stiff beyond s = c: y'' = -P y/EI(s) for small y, y(0) = y(1) = 0.

    python examples/stepped_column.py

The stiffness jumps at a breakpoint, which is always a mesh point; each piece has its own law. With k = sqrt(P) the two
halves of the buckled column join where

    tan(k c) + 2 tan(k (1 - c)/2) = 0;

P = 23.5725477 for c = 0.3137. Because the place is a parameter the buckling load is followed as the step moves, from
near 4 pi^2, where all is stiff, to near pi^2.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Locus, Solution, TraceOptions, follow_locus, trace


def column() -> BVP:
    """Soft, then stiff."""
    return BVP(
        [lambda s, u, p: [u.t, -p.P * np.sin(u.y)], lambda s, u, p: [u.t, -p.P * np.sin(u.y) / 4]],
        lambda left, right, p: [left.y, right.y],
        unknowns=("y", "t"),
        parameters={"P": 15.0, "c": 0.3137},
        scales={"P": 20.0},
        breakpoints=("c",),
    )


def main() -> tuple[Branch, Locus]:
    """The straight column up to its buckling load, and that load for every place of the step."""
    bvp = column()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, straight, ("P",), TraceOptions(bounds={"P": (15.0, 30.0)}), both=False)
    buckling = branch.special[0]
    print(f"buckling load {buckling.solution['P']:.6f} on {buckling.solution.intervals} intervals")
    locus = follow_locus(bvp, buckling, ("P", "c"), TraceOptions(bounds={"P": (9.0, 40.0), "c": (0.05, 0.95)}))
    for end in (locus.points[0], locus.points[-1]):
        print(f"step at {end.solution['c']:.2f}: P = {end.solution['P']:.6f}")
    return branch, locus


if __name__ == "__main__":
    main()
