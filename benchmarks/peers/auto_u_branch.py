"""AUTO-07p on the U branch of the perfectly anisotropic rod: dD from 0 to 0.79 at psi0 = 15 deg, dL = 1/2.

The engine is the one inside the PyPI package bifpy (its static library and AUTO's own main program); `auto/rod.f90`
is the user file, with analytic Jacobians. The start state is reached from the circle with detection off; then only
the run in dD is timed, as the CPU time (user + system) of AUTO's executable.

    auto_u_branch.py prepare WORK        compile, reach the start state, leave both in the folder WORK
    auto_u_branch.py measure WORK CASE   time one run; prints one JSON object
    auto_u_branch.py cases               print the names of the cases as a JSON list
"""

import argparse
import importlib.metadata
import importlib.util
import json
import math
import re
import resource
import shutil
import subprocess
from pathlib import Path

SOURCE = Path(__file__).parent / "auto" / "rod.f90"
COMPILE = ("gfortran", "-O3", "-march=native")
START_HEIGHT = 0.201870665

# A 'BR PT IT PAR L2-NORM' line of the diagnostic file, one per Newton iteration; IT = 0 is the predictor.
ITERATION_LINE = re.compile(r"^\s*\d+\s+\d+\s+[1-9]\d*\s+-?\d\.\d+E[-+]\d+\s", re.MULTILINE)
BRANCH_POINT, FOLD = 6, 5

# Forces and moments are O(10 - 1000), quaternion and position O(1): without the weights THU the same arc costs
# thousands of points. EPSS must stay 100 times larger than EPSL and EPSU, or the secant search for a pitchfork meets
# a Newton iteration that no longer converges. NPR = 0: no solutions on disk except at labels.
COMMON = {
    "NDIM": 13, "NBC": 13, "IPS": 4, "NTST": 50, "NCOL": 4, "IAD": 3, "IADS": 1, "JAC": 1, "NPAR": 10,
    "ITMX": 9, "ITNW": 7, "NWTN": 3, "EPSL": 1e-7, "EPSU": 1e-7, "EPSS": 1e-5, "NMX": 2000, "NPR": 0, "IID": 0,
    "DS": 0.01, "DSMIN": 1e-5, "DSMAX": 0.2, "THU": "{" + ", ".join(f"{i}: 1e-5" for i in range(1, 7)) + "}",
}  # fmt: skip
TO_HALF = {"ICP": "[2, 5]", "UZSTOP": "{2: 0.5}", "DS": -0.01, "ILP": 0, "ISP": 0}
TO_ANGLE = {"ICP": "[3, 5]", "UZSTOP": f"{{3: {math.radians(15)!r}}}", "DS": -0.01, "ILP": 0, "ISP": 0}
SHEAR = {"ICP": "[1, 5]", "ILP": 1, "ISP": 2, "RL1": 0.79}

# What a user would set (a curve fit to draw), and the fastest settings that still find both pitchforks, from a scan
# over step size, weights, mesh adaptation and NWTN. With NWTN = 1 the Jacobian is factored once a step and the other
# iterations reuse it (chord iterations), which makes them cheap.
CASES = {
    "ordinary steps": {"DSMAX": 0.02},
    "ordinary steps, chord": {"DSMAX": 0.02, "NWTN": 1},
    "larger steps": {"DSMAX": 0.05},
    "largest steps": {"DS": 0.05, "DSMAX": 0.5},
    "largest steps, chord": {"DS": 0.05, "DSMAX": 0.5, "NWTN": 1},
}


def build(work):
    """Compile the user file and link it with AUTO's main program and library; return the executable."""
    library = Path(importlib.util.find_spec("bifpy").submodule_search_locations[0]) / "auto" / "_lib"
    executable = work / "rod.exe"
    files = (library / "main.o", SOURCE, library / "libbifpy.a")
    subprocess.run([*COMPILE, "-I", library / "include", "-o", executable, *files], cwd=work, check=True)
    return executable


def last_words(output):
    """The end of an output in one line."""
    return " ".join(output.split())[-300:]


def run_auto(work, name, settings, restart=None):
    """Run AUTO once in ``work/name``.

    Parameters
    ----------
    work : Path
        Folder with the executable.
    name : str
        Folder of this run inside ``work``, emptied first.
    settings : dict
        AUTO constants on top of `COMMON`.
    restart : tuple of (str, int), optional
        Run and label to start from; without it AUTO starts from the circle.

    Returns
    -------
    seconds : float
        User + system CPU time of the executable.
    output : str
        What AUTO printed.
    """
    folder = work / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    constants = COMMON | {"IRS": 0} | settings
    if restart is not None:
        shutil.copy(work / restart[0] / "fort.8", folder / "fort.3")
        constants["IRS"] = restart[1]
    (folder / "fort.2").write_text("".join(f"{key} = {value}\n" for key, value in constants.items()))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([work / "rod.exe"], cwd=folder, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"AUTO failed in run {name!r}: {last_words(done.stdout + done.stderr)}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def read_branch(folder):
    """Rows of AUTO's bifurcation diagram as tuples (type, label, free parameter, height)."""
    lines = (folder / "fort.7").read_text().splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.startswith("   0")]
    return [(int(row[2]), int(row[3]), float(row[4]), float(row[-1])) for row in rows]


def stop_label(folder):
    """Label of the user-defined end point (type -4) of a run; the run failed if there is none."""
    labels = [label for kind, label, _, _ in read_branch(folder) if kind == -4]
    if not labels:
        raise SystemExit(f"AUTO did not reach the end point of the run {folder.name!r}")
    return labels[-1]


def prepare(work):
    """Compile, and go from the circle to the U state at psi0 = 15 deg, dL = 1/2, dD = 0."""
    work.mkdir(parents=True, exist_ok=True)
    build(work)
    run_auto(work, "half", TO_HALF)
    run_auto(work, "angle", TO_ANGLE, ("half", stop_label(work / "half")))
    height = read_branch(work / "angle")[-1][3]
    if abs(height - START_HEIGHT) > 1e-6:
        raise SystemExit(f"AUTO reached another state: height {height:.9f}, expected {START_HEIGHT}")


def count_iterations(work, case, restart):
    """Newton iterations of a case, from a run of its own, as writing the diagnostic file takes 2 % of the time."""
    run_auto(work, "count", SHEAR | CASES[case] | {"IID": 2}, restart)
    return len(ITERATION_LINE.findall((work / "count" / "fort.9").read_text()))


def measure(work, case):
    """Time one case and return the JSON object of the benchmark."""
    restart = ("angle", stop_label(work / "angle"))
    iterations = count_iterations(work, case, restart)
    seconds, output = run_auto(work, "shear", SHEAR | CASES[case], restart)
    branch = read_branch(work / "shear")
    if branch[-1][2] < SHEAR["RL1"]:
        raise SystemExit(f"AUTO stopped at dD = {branch[-1][2]:.6f}: {last_words(output)}")
    return {
        "name": f"AUTO-07p, {case}",
        "version": "bifpy " + importlib.metadata.version("bifpy"),
        "settings": CASES[case],
        "cpu_seconds": seconds,
        "points": len(branch),
        "newton_iterations": iterations,
        "ms_per_iteration": 1e3 * seconds / iterations,
        "branch_points": [value for kind, _, value, _ in branch if kind == BRANCH_POINT],
        "folds": [value for kind, _, value, _ in branch if kind == FOLD],
    }


def main():
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("prepare", "measure", "cases"))
    parser.add_argument("work", type=Path, nargs="?")
    parser.add_argument("case", choices=CASES, nargs="?")
    arguments = parser.parse_args()
    if arguments.action == "cases":
        print(json.dumps(list(CASES)))
        return
    if arguments.work is None or (arguments.action == "measure" and arguments.case is None):
        parser.error("prepare needs WORK, measure needs WORK and CASE")
    work = arguments.work.resolve()
    if arguments.action == "prepare":
        prepare(work)
    else:
        print(json.dumps(measure(work, arguments.case)))


if __name__ == "__main__":
    main()
