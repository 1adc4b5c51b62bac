"""AUTO-07p's demo `ezp`, a complex bifurcation: w'' + lam exp(w) = 0, w(0) = w(1) = 0 with complex w = u + i v.

    python examples/auto_ezp.py

Real solutions are Bratu's and end at its fold, lam = 3.513830719. Beyond it there is a pair of complex ones: the fold
is a branch point of the complex problem. All solutions are lam = t^2 / (2 cosh(t/4)^2), w(1/2) = 2 log cosh(t/4); t is
real up to the fold and complex beyond.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, integral_of, switch, trace


def complex_bratu() -> BVP:
    """Real and imaginary part, and their slopes."""
    return BVP(
        lambda s, u, p: {
            "u": u.du, "v": u.dv,
            "du": -p.lam * np.exp(u.u) * np.cos(u.v), "dv": -p.lam * np.exp(u.u) * np.sin(u.v),
        },
        lambda left, right, p: [left.u, left.v, right.u, right.v],
        unknowns=("u", "v", "du", "dv"),
        parameters={"lam": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
    )  # fmt: skip


def main() -> tuple[Branch, list[Branch]]:
    """The real branch with its fold, and the complex solutions beyond."""
    bvp = complex_bratu()
    zero = Solution.from_function(lambda s: np.zeros((len(s), 4)), bvp.unknowns, bvp.parameters)
    real = trace(bvp, zero, ("lam",), TraceOptions(bounds={"lam": (0.0, 10.0), "mean": (-1.0, 3.0)}))
    print(real)
    for special in real.special:
        print(f"{special.kind} at lam = {special.solution['lam']:.9f}, where lam turns: {special.turns}")
    at = real.of_kind("branch point")[0]
    options = TraceOptions(bounds={"lam": (0.0, 10.0)}, zeros={"lam": 5.0})
    pair = [side for i in (1, -1) if (side := switch(bvp, at, ("lam",), options, side=i)) is not None]
    for side in pair:
        print(side)
        for place in side.of_kind("zero of lam"):
            u, v = (place.solution(0.5, name)[0] for name in ("u", "v"))
            print(f"w(1/2) = {u:.9f} {v:+.9f} i at lam = 5")
    return real, pair


if __name__ == "__main__":
    main()
