"""The planar clamped elastica (EI = L = 1): buckling loads of the straight column and the buckled states.

    python examples/elastica.py

The thrust P is the continuation parameter; the shear force V is a second free parameter, because there is one boundary
condition more than there are unknowns.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, MeshControl, Solution, TraceOptions, integral_of, switch, trace

FREE = ("P", "V")


def elastica() -> BVP:
    """Height y, angle theta and curvature k along the arc, clamped horizontally at height zero."""
    return BVP(
        lambda s, u, p: {"y": np.sin(u.theta), "theta": u.k, "k": -p.P * np.sin(u.theta) + p.V * np.cos(u.theta)},
        lambda left, right, p: [left.y, left.theta, right.y, right.theta],
        unknowns=("y", "theta", "k"),
        parameters={"P": 10.0, "V": 0.0},
        observables={
            "compression": integral_of(lambda s, u, p: 1 - np.cos(u.theta)),
            "energy": integral_of(lambda s, u, p: u.k**2 / 2),
        },
        scales={"P": 100.0, "V": 100.0, "k": 10.0},
    )


def main() -> tuple[Branch, list[Branch]]:
    """The straight branch with its four lowest buckling loads, and both sides of the first mode."""
    bvp = elastica()
    options = TraceOptions(mesh=MeshControl(tolerance=1e-11), bounds={"P": (1.0, 260.0), "compression": (-0.1, 0.6)},
                           zeros={"compression": 0.5})  # fmt: skip
    straight = Solution.from_function(lambda s: np.zeros((len(s), 3)), bvp.unknowns, bvp.parameters)
    column = trace(bvp, straight, FREE, options)
    print(column)
    for special in column.special:
        print(f"buckling load {special.solution['P']:.8f}")
    sides = [switch(bvp, column.special[0], FREE, options, side=side) for side in (1, -1)]
    buckled = [side for side in sides if side is not None]
    for branch in buckled:
        for zero in branch.of_kind("zero of compression"):
            state = zero.solution
            print(
                f"ends half a length together: P = {state['P']:.8f}, energy = {state['energy']:.8f}, "
                f"height of the middle = {state(0.5, 'y')[0]:+.8f}"
            )
    return column, buckled


if __name__ == "__main__":
    main()
