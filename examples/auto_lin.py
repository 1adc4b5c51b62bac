"""AUTO-07p's demo `lin`, a linear eigenvalue problem: u'' + (lam pi)^2 u = 0, u(0) = g, u(1) = 0.

    python examples/auto_lin.py

Eigenvalues are branch points of u = 0: lam = 1, 2, 3, ... The eigenfunction is then followed to the norm e = 1 with
e = int u^2, and at this norm in lam and the boundary value g: u = g sin(lam pi (1 - s)) / sin(lam pi), so that

    g^2 (1/2 - sin(2 lam pi) / (4 lam pi)) = sin(lam pi)^2.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, switch, trace


def eigenvalue_problem() -> BVP:
    """The norm is an integral condition, e its value; lam is in units of pi."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": -((p.lam * np.pi) ** 2) * u.u},
        lambda left, right, p: [left.u - p.g, right.u],
        lambda s, u, p: u.u**2 - p.e,
        unknowns=("u", "v"),
        parameters={"lam": 0.5, "g": 0.0, "e": 0.0},
    )


def main() -> tuple[Branch, Branch, Branch]:
    """Eigenvalues up to 4.5, the first eigenfunction as it grows, and the curve of g at norm one."""
    bvp = eigenvalue_problem()
    zero = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    trivial = trace(bvp, zero, ("lam", "e"), TraceOptions(bounds={"lam": (0.5, 4.5)}))
    for special in trivial.special:
        print(f"{special.kind} at lam = {special.solution['lam']:.10f}")
    growing = switch(bvp, trivial.special[0], ("lam", "e"), TraceOptions(bounds={"e": (-1.0, 2.0)}, zeros={"e": 1.0}))
    assert growing is not None
    unit = growing.of_kind("zero of e")[0].solution
    print(f"eigenfunction of norm one: lam = {unit['lam']:.10f}, u'(0) = {abs(unit['v'][0]):.8f}")
    curve = trace(bvp, unit, ("lam", "g"), TraceOptions(bounds={"lam": (0.6, 1.4)}))
    print(curve)
    return trivial, growing, curve


if __name__ == "__main__":
    main()
