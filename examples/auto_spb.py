"""AUTO-07p's demo `spb`, a singularly perturbed problem: eps u'' = lam (u (u^2 - 1) u' + u), u(0) = 3/2, u(1) = gamma.

    python examples/auto_spb.py

A straight line solves it for lam = 0. Three runs lead to a thin layer: lam to 1, then eps to 0.001, then gamma down.
The mesh follows the layer.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation import BVP, Branch, Solution, TraceOptions, end_value, trace


def problem() -> BVP:
    """u and its slope v."""
    return BVP(
        lambda s, u, p: {"u": u.v, "v": p.lam * (u.u * (u.u**2 - 1) * u.v + u.u) / p.eps},
        lambda left, right, p: [left.u - 1.5, right.u - p.gamma],
        unknowns=("u", "v"),
        parameters={"gamma": 1.2, "eps": 0.1, "lam": 0.0},
        observables={"slope": end_value(lambda left, right, p: left.v),
                     "layer": end_value(lambda left, right, p: right.v)},
    )  # fmt: skip


def main() -> list[Branch]:
    """Homotopy in lam, then in eps, then in gamma."""
    bvp = problem()
    state = Solution.from_function(
        lambda s: np.column_stack([1.5 - 0.3 * s, np.full(len(s), -0.3)]), bvp.unknowns, bvp.parameters
    )
    runs = []
    for name, low, high, direction in (("lam", 0.0, 1.0, 1.0), ("eps", 0.001, 0.1, -1.0), ("gamma", -1.0, 1.2, -1.0)):
        run = trace(bvp, state, (name,), TraceOptions(bounds={name: (low, high)}), both=False, direction=direction)
        print(run)
        state = run.points[-1].solution
        print(f"  u'(0) = {state['slope']:.8f}, u'(1) = {state['layer']:.6f}, {state.intervals} intervals")
        runs.append(run)
    return runs


if __name__ == "__main__":
    main()
