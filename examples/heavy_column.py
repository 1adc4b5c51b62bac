"""Greenhill's problem, a clamped column that buckles under its own weight: theta'' + (P + w (1 - s)) sin(theta) = 0.

    python examples/heavy_column.py

EI = L = 1, theta(0) = theta'(1) = 0, w is the weight of the whole column and P a load on its tip. Without the load it
buckles at w = 7.837347, where the Bessel function J_(-1/3)(2/3 sqrt(w)) vanishes; without weight at P = pi^2/4, Euler's
load. In between, and for P < 0 (a column held up at its tip), Airy functions give the pairs of P and w.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import (
    BVP,
    Branch,
    Locus,
    MeshControl,
    Solution,
    TraceOptions,
    end_value,
    follow_locus,
    switch,
    trace,
)


def column() -> BVP:
    """Angle and curvature; s enters the equations."""
    return BVP(
        lambda s, u, p: {"theta": u.k, "k": -(p.P + p.w * (1 - s)) * np.sin(u.theta)},
        lambda left, right, p: [left.theta, right.k],
        unknowns=("theta", "k"),
        parameters={"w": 1.0, "P": 0.0},
        observables={"tip": end_value(lambda left, right, p: right.theta)},
        scales={"w": 10.0, "P": 3.0},
    )


def main() -> tuple[Branch, Branch, Locus]:
    """Critical weights, the bent column until its tip hangs, and the lowest critical weight over P."""
    bvp, mesh = column(), MeshControl(tolerance=1e-10)
    upright = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    straight = trace(bvp, upright, ("w",), TraceOptions(mesh=mesh, bounds={"w": (1.0, 150.0)}), both=False)
    for special in straight.special:
        print(f"critical weight {special.solution['w']:.9f}")
    options = TraceOptions(mesh=mesh, bounds={"tip": (-2.5, 2.5), "w": (1.0, 150.0)}, zeros={"tip": np.pi / 2})
    sides = [switch(bvp, straight.special[0], ("w",), options, side=i) for i in (1, -1)]
    bent = next(side for side in sides if side is not None and side.points[-1].solution["tip"] > 0)
    for special in bent.special:
        print(f"its tip is horizontal at w = {special.solution['w']:.9f}")
    bounds = {"P": (-5.0, 5.0), "w": (0.0, 50.0)}
    locus = follow_locus(bvp, straight.special[0], ("w", "P"), TraceOptions(mesh=mesh, bounds=bounds))
    print(locus)
    return straight, bent, locus


if __name__ == "__main__":
    main()
