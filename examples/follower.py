"""A cantilever under a load that turns with its tip: theta'' = -P sin(theta - eta theta(1)), EI = L = 1.

    python examples/follower.py

theta(0) = theta'(1) = 0. The load keeps its direction for eta = 0 (a dead load) and stays tangential for eta = 1
(Beck's column). The linearized equations give the static buckling loads P = k^2 with cos k = -eta/(1 - eta): there are
none for eta > 1/2, and the two lowest meet at eta = 1/2, P = pi^2. A buckled cantilever whose tip has turned by alpha
carries sqrt(P) = K(m) + F(arcsin(sin(eta alpha/2) / m), m) with the modulus m = sin((1 - eta) alpha/2).
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Locus, MeshControl, Solution, TraceOptions, follow_locus, switch, trace

FREE = ("P", "alpha")


def cantilever(eta: float = 0.25) -> BVP:
    """Angle and curvature; the angle of the tip enters the equations, so it is a parameter with its own condition."""
    return BVP(
        lambda s, u, p: {"theta": u.k, "k": -p.P * np.sin(u.theta - p.eta * p.alpha)},
        lambda left, right, p: [left.theta, right.k, right.theta - p.alpha],
        unknowns=("theta", "k"),
        parameters={"P": 1.0, "eta": eta, "alpha": 0.0},
        scales={"P": 10.0},
    )


def main() -> tuple[Branch, Branch, Locus]:
    """Buckling loads at eta = 1/4, the buckled states of the lowest one, and the loads as a function of eta."""
    bvp = cantilever()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"P": (1.0, 25.0), "alpha": (-2.5, 2.5)},
                           zeros={"alpha": 2.0})  # fmt: skip
    column = trace(bvp, straight, FREE, options, both=False)
    for special in column.of_kind("branch point"):
        print(f"buckling load {special.solution['P']:.9f}")
    sides = [switch(bvp, column.special[0], FREE, options, side=i) for i in (1, -1)]
    buckled = next(side for side in sides if side is not None and side.points[-1].solution["alpha"] > 0)
    for zero in buckled.of_kind("zero of alpha"):
        print(f"the tip has turned by 2 at P = {zero.solution['P']:.9f}")
    options = TraceOptions(bounds={"P": (1.0, 25.0), "eta": (-1.0, 1.0)})
    locus = follow_locus(bvp, column.special[0], ("P", "eta", "alpha"), options)
    print(locus)
    for event in locus.events:
        print(f"{event.kind} at eta = {event.solution['eta']:.9f}, P = {event.solution['P']:.8f}: {event.what}")
    return column, buckled, locus


if __name__ == "__main__":
    main()
