"""A pinned column with a spring in its middle: w'''' + P w'' = 0 but for a jump of w''' by -k w(1/2).

    python examples/support.py

The column buckles in one half wave, which the spring hinders, or in two, which it does not feel, at P = 4 pi^2. At
k = 16 pi^2 both happen together: a stiffer spring holds the middle as a rigid support does (Timoshenko and Gere,
"Theory of Elastic Stability", section 2.6). For one half wave, with c = sqrt(P),

    P = k/4 (1 - tan(c/2)/(c/2)).
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Inner, Locus, Solution, TraceOptions, follow_locus, trace, value_at


def column() -> BVP:
    """The shear force jumps by the force of the spring; a cubic term bends the buckled branch."""
    return BVP(
        lambda s, u, p: {"w": u.t, "t": u.m, "m": u.q, "q": -p.P * u.m - 50 * u.w**3},
        lambda left, right, p: [left.w, left.m, right.w, right.m],
        unknowns=("w", "t", "m", "q"),
        parameters={"P": 5.0, "k": 100.0},
        scales={"P": 20.0, "k": 50.0, "t": 3.0, "m": 10.0, "q": 30.0},
        inner=[Inner(0.5, jumps=lambda u, p: {"q": -p.k * u.w})],
        observables={"middle": value_at(0.5, lambda u, p: u.w)},
    )


def main() -> tuple[Branch, Locus]:
    """Buckling loads of the straight column, and the first one as the spring gets stiffer."""
    bvp = column()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 4)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, straight, ("P",), TraceOptions(bounds={"P": (5.0, 60.0)}), both=False)
    for special in branch.special:
        print(f"{special.kind} at P = {special.solution['P']:.6f}")
    locus = follow_locus(bvp, branch.special[0], ("P", "k"), TraceOptions(bounds={"P": (5.0, 60.0), "k": (0.0, 300.0)}))
    event = locus.events[0].solution
    print(f"one and two half waves together at k = {event['k']:.5f}, P = {event['P']:.6f}")
    return branch, locus


if __name__ == "__main__":
    main()
