"""Our half of the benchmark of loci: fold 12 and pitchfork 4 of the rod in the plane of shear and clamp angle.

`run.py` starts this file with the project's interpreter and one thread, and reads one JSON object from standard
output. What counts as CPU time is the walk along the locus, events on it included; the path to its first point, imports
and compilation are left out, as for AUTO.
"""

import json
import math
import sys
import time

from rodatlas.continuation import MeshControl, StepControl, TraceOptions, follow_locus, switch, trace
from rodatlas.rods import rod_problem
from rodatlas.rods.planar import planar_states
from rodatlas.rods.stability import morse_index_of

PLANE = ("dD", "psi0")
FIXED = MeshControl(intervals=(50, 50))  # what AUTO does: 50 intervals that move
POINTS = 100
STEP = StepControl(initial=0.01, maximum=0.02)  # as AUTO's


def pitchforks(angle_deg, high, **settings):
    """Branch points of U at an angle in degrees, for shears up to `high`."""
    start = planar_states(0.625, math.radians(angle_deg), 0.5)[0]["U"]
    options = TraceOptions(bounds={"dD": (0.0, high)}, **settings)
    return trace(rod_problem(), start, ("dD",), options, both=False).of_kind("branch point")


def fold_12():
    """The fold of US next to pitchfork 4, which is subcritical at 27.5 degrees."""
    options = TraceOptions(bounds={"dD": (0.0, 0.5)}, max_folds=0)
    branch = switch(rod_problem(), pitchforks(27.5, 0.4)[0], ("dD",), options)
    return branch.of_kind("fold")[0]


STARTS = {"fold 12": fold_12, "pitchfork 4": lambda: pitchforks(15.0, 0.4)[0]}


def locus(name):
    """Follow a locus from its start in one direction and say what it cost.

    Returns
    -------
    dict
        ``cpu_seconds`` (float), ``points`` (int), ``curve`` (list of [dD, psi0, arclength]),
        ``events`` (list of str).
    """
    options = TraceOptions(mesh=FIXED, step=STEP, max_points=POINTS - 1)  # and the start
    start = STARTS[name]()
    follow_locus(rod_problem(), start, PLANE, options, both=False)  # compile and warm the caches
    before = time.process_time()
    found = follow_locus(rod_problem(), start, PLANE, options, both=False)
    seconds = time.process_time() - before
    return {
        "cpu_seconds": seconds,
        "points": len(found.points),
        "curve": [[p.solution["dD"], p.solution["psi0"], p.arclength] for p in found.points],
        "events": [f"{e.kind} {e.parameter}".strip() for e in found.events],
    }


def run():
    """Both loci, and the branch points reported on U at 15 degrees up to dD = 0.85 with the index as a check."""
    found = pitchforks(15.0, 0.85, index=morse_index_of)
    return {
        "name": "rodatlas",
        "loci": {name: locus(name) for name in STARTS},
        "limit": 0.85,
        "branch_points": [x.solution["dD"] for x in found],
    }


if __name__ == "__main__":
    print(json.dumps(run(*sys.argv[1:])))
