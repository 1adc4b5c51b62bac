"""Speed of the search for states: boundary value problems per second of the batch kernel, and seconds of a search.

Run with the project's interpreter; prints one JSON object. Compilation and imports are left out, one thread is used.
"""

import json
import sys
import time

import numpy as np

from rodatlas.rods.ends import Ends
from rodatlas.states.discover import find_states
from rodatlas.states.shooting import shoot
from rodatlas.states.starts import Starts, relaxed

A = 0.625


def kernel(ends, count=2000, perturbation=1.02):
    """Solve many problems: known solutions, each as often as it was met, with constants off by 2 percent.

    Returns
    -------
    dict
        ``solved_per_second`` (float), ``iterations`` (mean), ``ms_per_iteration``, ``relative_error_of_force`` (against
        four times the steps), ``relaxations_per_second``.
    """
    begin = time.perf_counter()
    starts = relaxed(ends, A, 1, count, partly=False)
    relaxing = time.perf_counter() - begin
    known = shoot(starts, A)
    good = known.converged
    near = Starts(known.poses[good], known.constants[good] * perturbation)
    begin = time.perf_counter()
    shots = shoot(near, A)
    seconds = time.perf_counter() - begin
    ok = shots.converged
    fine = shoot(Starts(shots.poses[ok], shots.constants[ok] * perturbation), A, steps=20)
    both = fine.converged & (abs(fine.energy - shots.energy[ok]) < 1e-3 * fine.energy)
    force = np.linalg.norm(fine.constants[both, :3], axis=1)
    error = np.linalg.norm((fine.constants - shots.constants[ok])[both, :3], axis=1) / force
    iterations = shots.iterations[shots.converged]
    return {
        "solved_per_second": shots.converged.sum() / seconds,
        "iterations": iterations.mean(),
        "ms_per_iteration": 1e3 * seconds / iterations.sum(),
        "relative_error_of_force": {"median": np.median(error), "largest": error.max(), "largest_force": force.max()},
        "relaxations_per_second": count / relaxing,
    }


def main():
    ends = Ends(30.0, 0.5, 0.625)
    find_states(ends, starts=8)  # compile
    figures = {"low force": kernel(Ends(15.0, 0.5, 0.2)), "setting of MODEL": kernel(ends)}
    for name, stable in (("stable only", True), ("all", False)):
        begin = time.perf_counter()
        found = find_states(ends, stable_only=stable)
        figures[name] = {"seconds": time.perf_counter() - begin, **found.to_json()["search"]}
    json.dump(figures, sys.stdout, indent=1, default=float)
    print()


if __name__ == "__main__":
    main()
