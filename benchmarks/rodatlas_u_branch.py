"""Our half of the U-branch benchmark: the same arc, mesh and tolerance as the peers, by `rodatlas.continuation`.

`run.py` starts this file with the project's interpreter and one thread, and reads one JSON object from standard
output. What counts as CPU time is what counts for AUTO: the run in dD alone, detection and location included; the
path to the start solution, imports and compilation are left out.
"""

import json


def run() -> dict:
    """Trace the U branch at psi0 = 15 deg, dL = 0.5 from dD = 0 to 0.79 and say what it cost.

    Returns
    -------
    dict
        ``name`` (str), ``cpu_seconds`` (float), ``points`` (int), ``newton_iterations`` (int),
        ``ms_per_iteration`` (float), ``branch_points`` (list of dD), ``folds`` (list of dD).

    Raises
    ------
    SystemExit
        Always, until `rodatlas.continuation` can trace a branch.
    """
    raise SystemExit("rodatlas.continuation cannot trace this branch yet; only the peers are measured")


if __name__ == "__main__":
    print(json.dumps(run()))
