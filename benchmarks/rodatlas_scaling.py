"""Wall time of slices, and of several of them by one and by two processes.

Run with the project's interpreter; prints one JSON object. Every study starts its worker processes anew and writes its
results to a folder of its own; one slice is computed beforehand, so that nothing is compiled in what is measured.
"""

import json
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

from rodatlas import band_slice, compute_slice
from rodatlas.atlas.study import Study, run_study

ANGLES = (15.0, 45.0)  # of slices that are computed one by one
POISSON = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35)  # of the slices of a study, at 15 degrees
WORKERS = (1, 2)


def single(angle):
    """Wall seconds of a slice in this process, and how many branches and states it has."""
    begin = time.perf_counter()
    found = compute_slice(band_slice(angle))
    return {
        "angle": angle, "seconds": time.perf_counter() - begin, "branches": len(found.branches),
        "states": len(found.states), "warnings": len(found.warnings),
    }  # fmt: skip


def study(workers):
    """Wall seconds of a study from nothing to the last file, CPU seconds of its workers, and seconds of its tasks.

    CPU seconds tell what a second process costs even where the machine has other work to do.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        settings = [band_slice(15.0, poisson=nu) for nu in POISSON]
        found = run_study(Study.of("scaling", settings), Path(folder), workers=workers)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if found.failed:
        raise SystemExit(f"{found.failed[0].task.stem}: {found.failed[0].error}")
    return {
        "workers": workers, "wall_seconds": found.seconds, "task_seconds": [o.seconds for o in found.outcomes],
        "cpu_seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
    }  # fmt: skip


def main():
    compute_slice(band_slice(20.0, shear_max=0.1))  # compile, also what carries states from another slice
    figures = {"name": "rodatlas", "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None}
    figures["slices"] = [single(angle) for angle in ANGLES]
    figures["studies"] = [study(workers) for workers in WORKERS]
    json.dump(figures, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
