"""Stefan's problem: ice melts from a warm wall, and the front moves as 2 l sqrt(t).

    python examples/stefan.py

With x = 2 s sqrt(t) the temperature obeys T'' + 2 s T' = 0 between the wall, T(0) = 1, and the front, T(l) = 0, where
the heat that arrives melts the ice: S T'(l) = -2 l. The length l of the interval is unknown. Neumann's solution is
T = 1 - erf(s)/erf(l) with

    sqrt(pi) l exp(l^2) erf(l) = S.

The Stefan number S is followed in its logarithm, from 1e-6 to 100.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, trace, value_at


def melting() -> BVP:
    """On the interval from 0 to l; both S and l span decades, and q = l T' does not."""
    return BVP(
        lambda s, u, p: {"T": u.q / p.l, "q": -2 * s * u.q},
        lambda left, right, p: [left.T - 1, right.T, right.q + 2 * p.l**2 / p.S],
        unknowns=("T", "q"),
        parameters={"S": 1.0, "l": 0.6},
        interval=(0.0, "l"),
        log=("S", "l"),
        observables={"half": value_at(lambda p: p.l / 2, lambda u, p: u.T)},
    )


def main() -> Branch:
    """The front for all Stefan numbers."""
    bvp = melting()
    guess = Solution.from_function(lambda s: np.column_stack([1 - s, -1 + 0 * s]), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, guess, ("S", "l"), TraceOptions(bounds={"S": (1e-6, 100.0)}, zeros={"S": 1e-3}))
    print(f"{len(branch)} points")
    for at in (branch.points[0].solution, branch.special[0].solution, branch.points[-1].solution):
        print(f"S = {at['S']:.3g}: l = {at['l']:.9f}")
    return branch


if __name__ == "__main__":
    main()
