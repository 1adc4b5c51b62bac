"""Phases in a box: eps^2 u'' = mu - u + u^3 with u'(0) = u'(1) = 0 and the mean of u prescribed.

    python examples/phase_separation.py

The mean m is the continuation parameter. The condition "integral of u = m" is an integral condition, and the chemical
potential mu is the scalar that it determines. The uniform state u = m loses its stability where
eps^2 (k pi)^2 = 1 - 3 m^2 for k half waves.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, MeshControl, Solution, TraceOptions, switch, trace

FREE = ("m", "mu")


def phases(eps: float = 0.1) -> BVP:
    """The problem with the integral condition behind the boundary conditions."""
    return BVP(
        lambda s, u, p: [u.v / p.eps, (p.mu - u.u + u.u**3) / p.eps],
        lambda left, right, p: [left.v, right.v],
        lambda s, u, p: u.u - p.m,
        unknowns=("u", "v"),
        parameters={"m": 0.0, "mu": 0.0, "eps": eps},
    )


def main() -> tuple[Branch, Branch]:
    """The uniform states, and the closed branch of states with one front."""
    bvp = phases()
    options = TraceOptions(mesh=MeshControl(tolerance=1e-10), bounds={"m": (-1.0, 1.0)})
    uniform = trace(
        bvp, Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters), FREE, options
    )
    print(uniform)
    for special in uniform.special:
        print(f"{special.kind} at m = {special.solution['m']:+.9f}")
    front = switch(bvp, uniform.special[-1], FREE, options)
    assert front is not None
    print(front)
    for special in front.special:
        print(f"{special.kind} at m = {special.solution['m']:+.9f}, mu = {special.solution['mu']:+.9f}")
    return uniform, front


if __name__ == "__main__":
    main()
