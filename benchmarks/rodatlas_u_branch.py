"""Our half of the U-branch benchmark: the same arc, mesh and tolerance as the peers, by `rodatlas.continuation`.

`run.py` starts this file with the project's interpreter and one thread, and reads one JSON object from standard
output. What counts as CPU time is what counts for AUTO: the run in dD alone, detection and location included; the
path to the start solution, imports and compilation are left out.
"""

import json
import math
import sys
import time

from rodatlas.continuation import MeshControl, NewtonOptions, StepControl, TraceOptions, trace
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.planar import planar_states

MESHES = {
    "fixed": MeshControl(intervals=(50, 50)),  # what AUTO does: 50 intervals that move
    "adaptive": MeshControl(tolerance=1e-8),  # what a user of rodatlas gets
    "fast": MeshControl(tolerance=1e-6, every=5),  # still more accurate than what the fastest settings of AUTO find
}

STEPS = {"fast": StepControl(initial=0.05)}  # the first step that AUTO is given, too

LABELS = {
    "fixed": (),
    "adaptive": ("adaptive mesh",),
    "fast": ("larger steps, mesh to 1e-6",),
    "newton": (),
    "chord": ("chord",),
}


def run(mesh="fixed", corrector="newton"):
    """Trace the U branch at psi0 = 15 deg, dL = 0.5 from dD = 0 to 0.79 and say what it cost.

    Parameters
    ----------
    mesh : str
        ``'fixed'`` (50 intervals of 4 points, as the peers), ``'adaptive'`` (error tolerance 1e-8) or ``'fast'`` (1e-6,
        adapted every 5 steps, first step 0.05).
    corrector : str
        ``'newton'``, or ``'chord'`` for one factorization a step.

    Returns
    -------
    dict
        ``name`` (str), ``cpu_seconds`` (float), ``points`` (int), ``newton_iterations`` (int),
        ``ms_per_iteration`` (float), ``branch_points`` (list of dD), ``folds`` (list of dD).
    """
    bvp = rod_problem()
    start = planar_states(0.625, math.radians(15.0), 0.5)[0]["U"]
    newton = NewtonOptions(tolerance=1e-7, chord=corrector == "chord")
    step = STEPS.get(mesh, StepControl())
    options = TraceOptions(step=step, mesh=MESHES[mesh], newton=newton, bounds={"dD": (0.0, 0.79)})
    trace(bvp, start, ("dD",), options, both=False)  # compile and warm the caches
    before = time.process_time()
    branch = trace(bvp, start, ("dD",), options, both=False)
    seconds = time.process_time() - before
    return {
        "name": ", ".join(["rodatlas", *LABELS[mesh], *LABELS[corrector]]),
        "cpu_seconds": seconds,
        "points": len(branch),
        "newton_iterations": branch.newton_iterations,
        "ms_per_iteration": 1e3 * seconds / branch.newton_iterations,
        "branch_points": [x.solution["dD"] for x in branch.of_kind("branch point")],
        "folds": [x.solution["dD"] for x in branch.of_kind("fold")],
    }


if __name__ == "__main__":
    print(json.dumps(run(*sys.argv[1:])))
