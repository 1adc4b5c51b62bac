"""AUTO-07p's demo `kar`, von Karman's swirling flow between a rotating disk and a fluid that rotates at infinity.

    python examples/auto_kar.py

With z = Z s, f the axial velocity (up to a factor) and g the angular velocity in the frame of the fluid at infinity,

    f''' + 2 f f'' - f'^2 + g^2 + 2 gamma g = 0,    g'' + 2 f g' - 2 f' g - 2 gamma f' = 0,
    f = f' = 0, g = 1 - gamma at z = 0,

and the conditions of Lentini & Keller (1980) at z = Z = 500, which let only decaying solutions pass. The fluid rotates
with the disk at gamma = 1 and is at rest at gamma = 0, where von Karman's disk has f'' = 0.510232619,
g' = -0.615922014 on the disk; the first two folds are at gamma = -0.16053876 and 0.07452563 (Zandbergen & Dijkstra
1977), so that there is a second flow, and more, over a fluid at rest.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, MeshControl, Solution, TraceOptions, end_value, trace


def swirl(length: float = 500.0) -> BVP:
    """f, f', f'', g, g'; the value of f at infinity is the second free parameter."""

    def rhs(s, u, p):
        f2 = u.df**2 - 2 * u.f * u.ddf - u.g**2 - 2 * p.gamma * u.g
        g2 = 2 * p.gamma * u.df + 2 * u.df * u.g - 2 * u.f * u.dg
        return [p.Z * x for x in (u.df, u.ddf, f2, u.dg, g2)]

    def boundary(left, right, p):
        a = np.sqrt((np.sqrt(p.far**4 + 4 * p.gamma**2) + p.far**2) / 2)
        return [
            left.f, left.df, left.g - 1 + p.gamma, right.f - p.far,
            (p.far + a) * right.df + right.ddf - p.gamma * right.g / a,
            p.gamma / a * right.df + (p.far + a) * right.g + right.dg,
        ]  # fmt: skip

    return BVP(
        rhs, boundary, unknowns=("f", "df", "ddf", "g", "dg"), parameters={"gamma": 1.0, "far": 0.0, "Z": length},
        observables={"ddf0": end_value(lambda left, right, p: left.ddf),
                     "dg0": end_value(lambda left, right, p: left.dg)},
    )  # fmt: skip


def main() -> Branch:
    """From rigid rotation, through von Karman's flow, around the first fold to the second."""
    bvp = swirl()
    rigid = Solution.from_function(lambda s: np.zeros((len(s), 5)), bvp.unknowns, bvp.parameters)
    rigid = rigid.remesh(np.linspace(0.0, 1.0, 61) ** 2.5)  # the layer at the disk is not there yet to attract the mesh
    options = TraceOptions(mesh=MeshControl(intervals=(40, 400)), bounds={"gamma": (-1.0, 1.0)}, zeros={"gamma": 0.0},
                           max_folds=1)  # fmt: skip
    branch = trace(bvp, rigid, ("gamma", "far"), options, both=False, direction=-1.0)
    print(branch)
    for special in branch.special:
        at = special.solution
        print(f"{special.kind}: gamma = {at['gamma']:+.9f}, f(Z) = {at['far']:.8f}, "
              f"f'' = {at['ddf0']:.9f}, g' = {at['dg0']:.9f}")  # fmt: skip
    return branch


if __name__ == "__main__":
    main()
