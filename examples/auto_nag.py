"""AUTO-07p's demo `nag`, a front of Nagumo's equation: u'' - c u' + u (1 - u)(u - a) = 0 from u = 0 to u = 1.

    python examples/auto_nag.py

The connecting orbit is cut to a length T = 100: its ends lie in the unstable direction of u = 0 and in the stable one
of u = 1, u' = m u and u' = n (u - 1) with m^2 - c m = a, n^2 - c n = 1 - a. It exists for one speed,
c = (1 - 2 a) / sqrt(2), with the slope u' = u (1 - u) / sqrt(2) for every a.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, MeshControl, Solution, TraceOptions, end_value, trace


def front(length: float = 100.0) -> BVP:
    """u and its slope v; an integral condition centers the front."""
    return BVP(
        lambda s, u, p: [p.T * u.v, p.T * (p.c * u.v - u.u * (1 - u.u) * (u.u - p.a))],
        lambda left, right, p: [
            left.v - (p.c + np.sqrt(p.c**2 + 4 * p.a)) / 2 * left.u,
            right.v - (p.c - np.sqrt(p.c**2 + 4 * (1 - p.a))) / 2 * (right.u - 1),
        ],
        lambda s, u, p: u.u - 0.5,
        unknowns=("u", "v"),
        parameters={"a": 0.5, "c": 0.0, "T": length},
        observables={"tail": end_value(lambda left, right, p: left.u)},
    )


def standing(s: np.ndarray) -> np.ndarray:
    """The front at a = 1/2, which does not move."""
    u = 1 / (1 + np.exp(-100 * (s - 0.5) / np.sqrt(2)))
    return np.column_stack([u, u * (1 - u) / np.sqrt(2)])


def main() -> Branch:
    """The speed c as a function of a."""
    bvp = front()
    start = Solution.from_function(standing, bvp.unknowns, bvp.parameters, intervals=60)
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"a": (0.0, 1.0)}, zeros={"a": 0.2})
    branch = trace(bvp, start, ("a", "c"), options)
    print(branch)
    for special in branch.special:
        print(f"speed at a = {special.solution['a']:.3f}: {special.solution['c']:.10f}")
    return branch


if __name__ == "__main__":
    main()
