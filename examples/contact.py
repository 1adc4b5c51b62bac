"""A pinned column that leans on a wall at distance h: free, in contact from c to d, and free again.

    python examples/contact.py

Small deflections: w'''' + P w'' = 0 on all pieces. Where contact begins w = h, w' = 0 and w'' = 0, and the wall pushes
back with a force R, a jump of w'''; then the column lies flat. With k = sqrt(P)

    c = pi/k,    R = -h k^3/pi,    w = h (k s + sin(k s))/pi on the free piece,

as long as c < 1/2, that is P > 4 pi^2 (below, it touches at a point only). Both ends of the contact and both forces are
unknown: five free parameters, for there are four conditions more than unknowns.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Inner, Solution, TraceOptions, trace, value_at

DERIVATIVES = (np.sin, np.cos, lambda x: -np.sin(x), lambda x: -np.cos(x))  # of one half wave, to begin with


def column() -> BVP:
    """Continuity says the rest: at d the column still lies flat."""
    return BVP(
        lambda s, u, p: {"w": u.t, "t": u.m, "m": u.q, "q": -p.P * u.m},
        lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"),
        parameters={"P": 70.0, "h": 0.1, "c": 0.4, "d": 0.6, "R": -20.0, "Q": -20.0},
        scales={"P": 20.0, "t": 3.0, "m": 10.0, "q": 30.0, "R": 20.0, "Q": 20.0},
        inner=[
            Inner(
                "c",
                jumps=lambda u, p: {"q": p.R},
                conditions=lambda left, right, p: [left.w - p.h, left.t, left.m, right.q],
            ),
            Inner("d", jumps=lambda u, p: {"q": p.Q}),
        ],
        observables={"halfway": value_at(lambda p: p.c / 2, lambda u, p: u.w)},
    )


def main() -> Branch:
    """Contact as the load grows, from P = 45 to P = 400."""
    bvp = column()
    guess = Solution.from_function(
        lambda s: 0.1 * np.column_stack([f(np.pi * s) * np.pi**i for i, f in enumerate(DERIVATIVES)]),
        bvp.unknowns,
        bvp.parameters,
    )
    branch = trace(bvp, guess, ("P", "c", "d", "R", "Q"), TraceOptions(bounds={"P": (45.0, 400.0)}))
    for point in (branch.points[0], branch.points[-1]):
        at = point.solution
        print(f"P = {at['P']:.1f}: contact from {at['c']:.6f} to {at['d']:.6f}, force {-at['R']:.5f}")
    return branch


if __name__ == "__main__":
    main()
