"""Speed of the search for states: boundary value problems per second of the batch kernels, and seconds of a search.

Run with the project's interpreter; prints one JSON object. CPU time of one thread, compilation and imports left out;
only the wall time of the command is that of a user, start-up included.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from rodatlas.rods.ends import Ends
from rodatlas.rods.law import LinearLaw
from rodatlas.states.discover import find_states
from rodatlas.states.search import default_threads
from rodatlas.states.shooting import Plan, shoot
from rodatlas.states.starts import Starts, relaxed

BAND = LinearLaw(0.625)
COUNT = 2000
SETTINGS = {
    "15 deg, 0.2": Ends(15.0, 0.5, 0.2), "30 deg, 0.625": Ends(30.0, 0.5, 0.625), "45 deg, 0.8": Ends(45.0, 0.5, 0.8),
}  # fmt: skip
COMMAND = ("states", "--angle", "30", "--shear", "0.625", "--stable-only")


def kernel(ends, perturbation=1.02):
    """Relax random bands; solve again for the states they lead to, n and m(0) off by 2 percent.

    Returns
    -------
    dict
        ``relaxed_per_second``, ``relaxed`` (fraction that leads to a solution), ``solved_per_second``, ``iterations``
        (mean), ``error_of_force`` (relative, against four times the steps; median and largest), ``largest_force``.
    """
    begin = time.process_time()
    starts = relaxed(ends, BAND, 1, range(COUNT), partly=False)
    relaxing = time.process_time() - begin
    known = shoot(starts, BAND)
    good = np.flatnonzero(known.converged & (known.segments == np.bincount(known.segments[known.converged]).argmax()))
    segments = int(known.segments[good[0]])
    plan = Plan(np.inf, segments, 5, segments > 8)
    near = Starts(known.poses[good], known.constants[good] * perturbation)
    begin = time.process_time()
    shots = shoot(near, BAND, plan=plan)
    seconds = time.process_time() - begin
    ok = shots.converged
    fine = shoot(Starts(shots.poses[ok], shots.constants[ok] * perturbation), BAND, plan=plan._replace(steps=20))
    both = fine.converged & (abs(fine.energy - shots.energy[ok]) < 1e-3 * fine.energy)
    force = np.linalg.norm(fine.constants[both, :3], axis=1)
    error = np.linalg.norm((fine.constants - shots.constants[ok])[both, :3], axis=1) / force
    return {
        "relaxed_per_second": COUNT / relaxing, "relaxed": known.converged.mean(), "segments": segments,
        "solved_per_second": ok.sum() / seconds, "iterations": shots.iterations[ok].mean(),
        "error_of_force": [np.median(error), error.max()], "largest_force": force.max(),
    }  # fmt: skip


def search(ends, **options):
    """CPU seconds of a search in one thread, and what it says of itself."""
    begin = time.process_time()
    found = find_states(ends, threads=1, **options)
    return {"cpu_seconds": time.process_time() - begin, "states": len(found.states), **found.to_json()["search"]}


def command():
    """Wall seconds of the command that finds the stable states of 30 degrees and 0.625, start-up included."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "states.json"
        subprocess.run([sys.executable, "-m", "rodatlas", *COMMAND, "--json", str(target)], check=True,
                       capture_output=True)  # fmt: skip
        states = json.loads(target.read_text())["states"]
    return {"wall_seconds": time.perf_counter() - begin, "states": len(states), "threads": default_threads()}


def main():
    find_states(Ends(30.0, 0.5, 0.75), starts=8)  # compile
    find_states(Ends(30.0, 0.5, 0.8), starts=8, stable_only=True)
    figures = {
        "name": "rodatlas",
        "kernels": {name: kernel(ends) for name, ends in SETTINGS.items()},
        "stable": {name: search(ends, stable_only=True) for name, ends in SETTINGS.items()},
        "all": {name: search(SETTINGS[name]) for name in ("30 deg, 0.625",)},
        "command": command(),
    }
    json.dump(figures, sys.stdout, indent=1, default=float)
    print()


if __name__ == "__main__":
    main()
