"""A shallow arch under a distributed load, (w - w0)'''' + N w'' = -q sin(pi x): it snaps through.

    python examples/arch.py

The unloaded arch is w0 = h sin(pi x), its ends are pinned, and the thrust N = 2 int (w0'^2 - w'^2) dx. Fung & Kaplan
(1952) found every state in closed form. Symmetric ones, w = a sin(pi x), need q/pi^4 = h - a + a (h^2 - a^2): for h > 1
there are limit loads where a^2 = (h^2 - 1)/3, q/pi^4 = h +- 2 ((h^2 - 1)/3)^(3/2). An arch with h > 2 can also give
way sideways, at N = 4 pi^2, that is a^2 = h^2 - 4; it does so before it reaches its limit load when h^2 > 11/2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodatlas.continuation import (
    BVP,
    Branch,
    Locus,
    MeshControl,
    Solution,
    Symmetry,
    TraceOptions,
    follow_locus,
    integral_of,
    trace,
)

PI = np.pi


def arch(h: float = 3.0, symmetries: Sequence[Symmetry] = ()) -> BVP:
    """Shape w and its derivatives; the condition for the thrust N is an integral condition."""
    return BVP(
        lambda s, u, p: {
            "w": u.slope, "slope": u.bend, "bend": u.third,
            "third": (p.h * PI**4 - p.q) * np.sin(PI * s) - p.N * u.bend,
        },
        lambda left, right, p: [left.w, right.w, left.bend, right.bend],
        lambda s, u, p: 2 * ((p.h * PI * np.cos(PI * s)) ** 2 - u.slope**2) - p.N,
        unknowns=("w", "slope", "bend", "third"),
        parameters={"q": 0.0, "h": h, "N": 0.0},
        observables={"a": integral_of(lambda s, u, p: 2 * u.w * np.sin(PI * s))},
        scales={"q": 1000.0, "N": 50.0, "h": 1.0}, symmetries=symmetries,
    )  # fmt: skip


def unloaded(s: np.ndarray) -> np.ndarray:
    """The arch of height 3 without a load."""
    x = PI * s
    return 3 * np.column_stack([np.sin(x), PI * np.cos(x), -(PI**2) * np.sin(x), -(PI**3) * np.cos(x)])


def main() -> tuple[Branch, list[Locus]]:
    """The symmetric states of an arch of height 3, and its critical loads as functions of the height."""
    bvp = arch()
    start = Solution.from_function(unloaded, bvp.unknowns, bvp.parameters)
    mesh = MeshControl(tolerance=1e-10)
    options = TraceOptions(mesh=mesh, bounds={"q": (-600.0, 1500.0), "a": (-4.0, 4.0)})
    branch = trace(bvp, start, ("q", "N"), options)
    print(branch)
    for special in branch.special:
        print(f"{special.kind} at q/pi^4 = {special.solution['q'] / PI**4:.9f}, a = {special.solution['a']:+.7f}")
    options = TraceOptions(mesh=mesh, bounds={"q": (-2000.0, 1500.0), "h": (0.5, 3.5)})
    free = ("q", "h", "N")
    loci = [follow_locus(bvp, branch.of_kind(kind)[0], free, options) for kind in ("fold", "branch point")]
    for locus in loci:
        print(locus)
        for event in locus.events:
            q, h = event.solution["q"] / PI**4, event.solution["h"]
            print(f"  {event.kind} at h = {h:.7f}, q/pi^4 = {q:.7f}: {event.what} ({event.status.value})")
    return branch, loci


if __name__ == "__main__":
    main()
