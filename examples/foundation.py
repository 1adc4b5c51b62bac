"""A pinned column on an elastic foundation, u'''' + P u'' + k u + c u^3 = 0: two buckling modes change places.

    python examples/foundation.py

With u = u'' = 0 at both ends, half-wave number n buckles at P = (n pi)^2 + k / (n pi)^2. Mode 1 is the first for
k < 4 pi^4, mode 2 beyond; both buckle at once for k = 4 pi^4, P = 5 pi^2.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Locus, MeshControl, Solution, TraceOptions, follow_locus, trace


def foundation(k: float = 100.0) -> BVP:
    """Deflection and its first three derivatives."""
    return BVP(
        lambda s, u, p: [u.slope, u.bend, u.third, -p.P * u.bend - p.k * u.u - p.c * u.u**3],
        lambda left, right, p: [left.u, left.bend, right.u, right.bend],
        unknowns=("u", "slope", "bend", "third"),
        parameters={"P": 5.0, "k": k, "c": 1.0},
        scales={"slope": 3.0, "bend": 10.0, "third": 30.0, "P": 50.0, "k": 400.0},
    )


def main() -> tuple[Branch, list[Locus]]:
    """The straight column at k = 100, and its two lowest buckling loads as functions of k."""
    bvp = foundation()
    straight = Solution.from_function(lambda s: np.zeros((len(s), 4)), bvp.unknowns, bvp.parameters)
    mesh = MeshControl(tolerance=1e-10)
    column = trace(bvp, straight, ("P",), TraceOptions(mesh=mesh, bounds={"P": (5.0, 200.0)}), both=False)
    for n, special in enumerate(column.special, start=1):
        print(f"mode {n} buckles at P = {special.solution['P']:.9f}")
    options = TraceOptions(mesh=mesh, bounds={"k": (0.0, 800.0), "P": (0.0, 150.0)})
    loci = [follow_locus(bvp, special, ("P", "k"), options) for special in column.special[:2]]
    for n, locus in enumerate(loci, start=1):
        print(f"mode {n}: {locus}")
        for event in locus.events:
            print(f"  {event.kind} at k = {event.solution['k']:.7f}, P = {event.solution['P']:.8f}: {event.what}")
    return column, loci


if __name__ == "__main__":
    main()
