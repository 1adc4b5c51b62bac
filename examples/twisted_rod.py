"""A clamped round rod, twisted at one end: a circle of buckled states leaves the straight one.

    python examples/twisted_rod.py

EI = L = 1, GJ = 0.8. One clamp turns about its axis by `turn` and slides along it without thrust. The straight rod,
with moment M = GJ turn, buckles where tan(M/2) = M/2: at M = 8.986818916. It may do so in any plane through the axis:
the rotation about it, of space and back of the cross section, is a continuous symmetry. It is declared by its
generator; one member of each orbit is then followed, with a phase condition that nobody has to write.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rodatlas.continuation import (
    BVP,
    Branch,
    ContinuousSymmetry,
    Solution,
    TraceOptions,
    end_value,
    switch_all,
    trace,
)

STIFFNESS = 0.8  # GJ/EI
UNKNOWNS = ("n1", "n2", "n3", "m1", "m2", "m3", "q0", "q1", "q2", "q3", "x", "y", "z")


def equations(s: Any, u: Any, p: Any) -> list[Any]:
    """Force n and moment m in space, the quaternion of the cross section, and its center: n' = 0, m' = n x d3."""
    q0, q1, q2, q3 = u.q0, u.q1, u.q2, u.q3
    d1 = [q0**2 + q1**2 - q2**2 - q3**2, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)]
    d2 = [2 * (q1 * q2 - q0 * q3), q0**2 - q1**2 + q2**2 - q3**2, 2 * (q2 * q3 + q0 * q1)]
    d3 = [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0**2 - q1**2 - q2**2 + q3**2]
    k1, k2, m3 = (sum(a * b for a, b in zip(d, (u.m1, u.m2, u.m3), strict=True)) for d in (d1, d2, d3))
    k3 = m3 / STIFFNESS
    return [
        0, 0, 0,
        u.n2 * d3[2] - u.n3 * d3[1], u.n3 * d3[0] - u.n1 * d3[2], u.n1 * d3[1] - u.n2 * d3[0],
        (-q1 * k1 - q2 * k2 - q3 * k3) / 2, (q0 * k1 - q3 * k2 + q2 * k3) / 2,
        (q3 * k1 + q0 * k2 - q1 * k3) / 2, (-q2 * k1 + q1 * k2 + q0 * k3) / 2,
        *d3,
    ]  # fmt: skip


def clamps(left: Any, right: Any, p: Any) -> list[Any]:
    """The left end stays; the right one is turned, stays on the axis, and slides along it."""
    c, s = np.cos(p.turn / 2), np.sin(p.turn / 2)
    start = [left.x, left.y, left.z, left.q0 - 1, left.q1, left.q2, left.q3]
    end = [c * right.q1 + s * right.q2, c * right.q2 - s * right.q1, c * right.q3 - s * right.q0]
    return [*start, *end, right.x, right.y, right.n3]


def rotation(s: Any, u: Any, p: Any) -> dict[str, Any]:
    """Velocities in a rotation about the axis: of all vectors, and of the vector part of the quaternion."""
    pairs = (("n1", "n2"), ("m1", "m2"), ("q1", "q2"), ("x", "y"))
    return {name: value for a, b in pairs for name, value in ((a, -getattr(u, b)), (b, getattr(u, a)))}


def rod(declared: bool = True) -> BVP:
    return BVP(
        equations,
        clamps,
        unknowns=UNKNOWNS,
        parameters={"turn": 10.0},
        observables={
            "moment": end_value(lambda left, right, p: right.m3),
            "distance": end_value(lambda left, right, p: right.z),
        },
        symmetries=[ContinuousSymmetry("rotation", rotation)] if declared else [],
        identities=lambda u, p: u.q0**2 + u.q1**2 + u.q2**2 + u.q3**2 - 1,
        name="twisted rod",
    )


def straight(bvp: BVP, turn: float) -> Solution:
    """The twisted straight rod."""

    def state(s: np.ndarray) -> np.ndarray:
        values = np.zeros((len(s), len(UNKNOWNS)))
        values[:, 5], values[:, 6], values[:, 9] = STIFFNESS * turn, np.cos(turn * s / 2), np.sin(turn * s / 2)
        values[:, 12] = s
        return values

    return Solution.from_function(state, bvp.unknowns, {"turn": turn})


def main() -> tuple[BVP, Branch, Branch]:
    """The straight rod to its first branch point, and the buckled one until its clamps are half a length apart."""
    bvp = rod()
    trunk = trace(bvp, straight(bvp, 10.0), ("turn",), TraceOptions(bounds={"turn": (10.0, 13.0)}), both=False)
    (point,) = trunk.special
    print(f"buckles at M = {point.solution['moment']:.7f}, kernel of dimension {point.multiplicity}")
    options = TraceOptions(bounds={"distance": (0.5, 1.1)})
    (buckled,) = switch_all(bvp, point, ("turn",), options)
    end = buckled.points[-1].solution
    print(f"one member of the orbit under {', '.join(buckled.orbit)}: {buckled!r}")
    print(f"clamps half a length apart at M = {end['moment']:.7f}, turn = {end['turn']:.7f}")
    return bvp, trunk, buckled


if __name__ == "__main__":
    main()
