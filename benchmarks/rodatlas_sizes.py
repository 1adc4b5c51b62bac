"""Our half of the benchmark of sizes: n/2 coupled Bratu equations, by `rodatlas.continuation`, up to n = 120.

    u_i'' + lam exp(u_i) = coupling, u_i(0) = u_i(1) = 0

In a chain each u_i is coupled to its two neighbors, in a cluster to the mean of all. Equal u_i feel no coupling, so
that the fold is Bratu's, whatever n. `run.py` starts this file with one thread, and reads one JSON object from
standard output; CPU time is that of the branch, without imports and compilation.
"""

import json
import time

import numpy as np

from rodatlas.continuation import BVP, NewtonOptions, Solution, TraceOptions, integral_of, trace

FOLD = 3.513830719125161
SIZES = (10, 20, 40, 60, 120)


def coupled(n, kind):
    """n unknowns: n/2 values and their slopes."""
    half = range(n // 2)

    def rhs(s, u, p):
        values = [getattr(u, f"u{i}") for i in half]
        if kind == "chain":
            pairs = [(max(i - 1, 0), min(i + 1, n // 2 - 1)) for i in half]
            pull = [2 * values[i] - values[a] - values[b] for i, (a, b) in zip(half, pairs, strict=True)]
        else:
            mean = sum(values) / len(half)
            pull = [value - mean for value in values]
        slopes = {f"u{i}": getattr(u, f"v{i}") for i in half}
        return slopes | {f"v{i}": 2 * pull[i] - p.lam * np.exp(values[i]) for i in half}

    return BVP(
        rhs,
        lambda left, right, p: [getattr(end, f"u{i}") for end in (left, right) for i in half],
        unknowns=tuple([f"u{i}" for i in half] + [f"v{i}" for i in half]),
        parameters={"lam": 0.0},
        observables={"mean": integral_of(lambda s, u, p: u.u0)},
    )


def run(n, kind, chord):
    """Follow the branch around its fold; what it cost."""
    bvp = coupled(n, kind)
    zero = Solution.from_function(lambda s: np.zeros((len(s), n)), bvp.unknowns, bvp.parameters)
    options = TraceOptions(
        bounds={"lam": (0.0, 4.0), "mean": (-1.0, 2.0)}, locate=("fold",), newton=NewtonOptions(chord=chord)
    )
    before = time.process_time()
    branch = trace(bvp, zero, ("lam",), options)
    seconds = time.process_time() - before
    return {
        "unknowns": n, "kind": kind, "chord": chord, "cpu_seconds": seconds, "points": len(branch),
        "intervals": branch.points[-1].solution.intervals,
        "error": max(abs(x.solution["lam"] - FOLD) for x in branch.special),
    }  # fmt: skip


if __name__ == "__main__":
    run(4, "chain", False)  # compile
    print(json.dumps([run(n, kind, chord) for kind in ("chain", "cluster") for n in SIZES for chord in (False, True)]))
