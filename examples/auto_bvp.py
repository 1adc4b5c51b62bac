"""AUTO-07p's demo `bvp`, a nonlinear eigenvalue problem: u'' + (lam pi)^2 u - u^2 = 0, u(0) = u(1) = 0.

    python examples/auto_bvp.py

Branches leave u = 0 at lam = 1, 2, 3, ...; those of odd number are transcritical, those of even number pitchforks.
The equation has the first integral v^2/2 + (lam pi)^2 u^2/2 - u^3/3, which gives every state by quadrature.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, integral_of, switch, trace


def problem() -> BVP:
    """The mean of u, a parameter with an integral condition in AUTO's file, is an observable here."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": -((p.lam * np.pi) ** 2) * u.u + u.u**2},
        lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"),
        parameters={"lam": 0.5},
        observables={"mean": integral_of(lambda s, u, p: u.u)},
        scales={"u": 10.0, "v": 30.0},
    )


def main() -> tuple[Branch, list[list[Branch]]]:
    """The zero solution, and both sides of the branches that leave it at lam = 1 and 2."""
    bvp = problem()
    zero = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    trivial = trace(bvp, zero, ("lam",), TraceOptions(bounds={"lam": (0.5, 4.5)}))
    print(trivial)
    options = TraceOptions(bounds={"lam": (0.0, 5.5), "mean": (-9.0, 9.0)}, zeros={"mean": 3.0})
    others = []
    for special in trivial.special[:2]:
        assert special.normal_form is not None
        print(f"{special.normal_form.kind} branch point at lam = {special.solution['lam']:.10f}")
        sides = [switch(bvp, special, ("lam",), options, side=i) for i in (1, -1)]
        others.append([side for side in sides if side is not None])
        for side in others[-1]:
            print("  ", side)
            for place in side.of_kind("zero of mean"):
                print(f"   mean 3 at lam = {place.solution['lam']:.9f}")
    return trivial, others


if __name__ == "__main__":
    main()
