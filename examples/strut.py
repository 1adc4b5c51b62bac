"""A strut with pinned ends rises in the middle as it buckles, but not for ever: where is the rise largest?

    python examples/strut.py

With bending stiffness b and length l the elastica b theta'' = -P sin(theta) has P = 4 K^2 b / l^2 and the rise
(k / K) l, where K = K(k) is the complete elliptic integral and k the sine of half the angle at the ends. The rise is
largest, 0.4031 l, where 2 K = E / (1 - k^2): at k = 0.8375, P = 1.7489 times Euler's load. The load of the largest
rise and the rise itself scale with b and l as they do anywhere, which their exact derivatives have to show.
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
    sensitivity,
    switch,
    trace,
)


def strut() -> BVP:
    """One half of the strut: angle, bending moment and deflection from a pin to the middle."""
    return BVP(
        lambda s, u, p: {
            "theta": p.l * u.m / (2 * p.b), "m": -p.l * p.P * np.sin(u.theta) / 2, "y": p.l * np.sin(u.theta) / 2
        },
        lambda left, right, p: [left.m, right.theta, left.y],
        unknowns=("theta", "m", "y"),
        parameters={"P": 5.0, "b": 1.0, "l": 1.0},
        observables={"rise": end_value(lambda left, right, p: right.y)},
        scales={"P": 10.0},
    )  # fmt: skip


def main() -> tuple[Branch, Locus, dict[str, float], dict[str, float]]:
    """The buckled states, the largest rise for all stiffnesses, and how its load and size depend on b and l."""
    bvp = strut()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 3)), bvp.unknowns, bvp.parameters)
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"P": (5.0, 40.0)}, extrema=("rise",))
    trunk = trace(bvp, straight, ("P",), options)
    buckled = switch(bvp, trunk.special[0], ("P",), options)
    assert buckled is not None
    (largest,) = buckled.of_kind("extremum of rise")
    print(f"the rise is largest, {abs(largest.solution['rise']):.9f}, at P = {largest.solution['P']:.7f}")
    load, rise = sensitivity(bvp, largest), sensitivity(bvp, largest, of="rise")
    for name in ("b", "l"):
        print(f"for each unit of {name} the load changes by {load[name]:.6f}, the rise by {rise[name]:.6f}")
    bounds = {"b": (0.5, 2.0)}
    locus = follow_locus(bvp, largest, ("P", "b"), TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds=bounds))
    print(locus)
    return buckled, locus, load, rise


if __name__ == "__main__":
    main()
