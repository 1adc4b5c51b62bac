"""Shots from many starts, in threads: the compiled kernels do not hold the interpreter's lock."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from rodatlas.rods.ends import Ends
from rodatlas.rods.law import Law
from rodatlas.states.shooting import PLANS, Shots, all_shots, shoot
from rodatlas.states.starts import Starts, random_forces, relaxed

CHUNK = 64  # starts that one thread works on at a time; results do not depend on who did which


def default_threads() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def hunt(
    ends: Ends, law: Law, sign: int, kind: str, rows: range, *, seed: int = 1, force: float = 200.0, threads: int = 1
) -> Shots:
    """Shoot from the starts of one kind, at given places of their quasi-random sequence.

    Parameters
    ----------
    law : of the perfectly anisotropic rod.
    sign : class, +1 or -1. kind : 'relaxed', 'partly relaxed' or 'forces'.
    rows : places in the sequence, one for each start.
    force : range of random forces [GJ/L^2]. threads : the result is the same for every number.
    """
    make: Callable[[range], Starts] = {
        "relaxed": lambda part: relaxed(ends, law, sign, part, partly=False, seed=seed),
        "partly relaxed": lambda part: relaxed(ends, law, sign, part, partly=True, seed=seed),
        "forces": lambda part: random_forces(ends, law, sign, part, force, seed + 1),
    }[kind]

    plan = PLANS[0] if kind == "forces" else None

    def work(part: range) -> Shots:
        return shoot(make(part), law, plan=plan)

    parts = [rows[i : i + CHUNK] for i in range(0, len(rows), CHUNK)]
    if threads == 1 or len(parts) < 3:
        return all_shots([work(part) for part in parts])
    first = work(parts[0])  # compiles what is not compiled, before the threads start
    with ThreadPoolExecutor(threads) as pool:
        try:
            return all_shots([first, *pool.map(work, parts[1:])])
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
