"""AUTO-07p on loci of the rod: fold 12 and pitchfork 4 in the plane of shear and clamp angle, 100 points each.

The engine, the user file and the way to the U state are those of `auto_u_branch.py`. From a label on a branch AUTO
first generates starting data (ISW = 2), then follows the locus from there; only that run is timed, as CPU time (user +
system) of AUTO's executable. The locus of the pitchfork is AUTO's non-generic case: symmetry keeps the branch point.

    auto_loci.py prepare WORK        compile, reach the starting data of both loci, leave them in the folder WORK
    auto_loci.py measure WORK CASE   time both loci; prints one JSON object
    auto_loci.py cases               print the names of the cases as a JSON list
"""

import argparse
import importlib.metadata
import json
import math
from pathlib import Path

import auto_u_branch as auto

POINTS = 100
LOCUS = {"ICP": "[1, 3]", "ISW": 2, "ILP": 0, "ISP": 0, "NMX": POINTS, "DSMAX": 0.02}
FALSE_LIMIT = 0.82

# name -> run and type of the label from which its starting data are made, and the direction in which ours goes
LOCI = {"fold 12": ("us", auto.FOLD, 0.01), "pitchfork 4": ("u15", auto.BRANCH_POINT, -0.01)}
# With NWTN = 1 the Jacobian is factored once a step and the other iterations reuse it (chord iterations).
CASES = {"ordinary steps": {}, "ordinary steps, chord": {"NWTN": 1}}


def folder_of(name):
    """Name of the folder with the starting data of a locus."""
    return "start-" + name.replace(" ", "-")


def first_label(folder, kind):
    """Label of the first special point of a type on a branch."""
    labels = [label for found, label, _, _ in auto.read_branch(folder) if found == kind]
    if not labels:
        raise SystemExit(f"AUTO found no point of type {kind} in the run {folder.name!r}")
    return labels[0]


def last_label(folder):
    """The last label of a run."""
    return [label for _, label, _, _ in auto.read_branch(folder) if label > 0][-1]


def prepare(work):
    """Go from the circle to U at 15 and 27.5 degrees, along US to its fold, and make the starting data of both loci."""
    work.mkdir(parents=True, exist_ok=True)
    auto.build(work)
    auto.run_auto(work, "half", auto.TO_HALF)
    for name, degrees in (("15", 15.0), ("27", 27.5)):
        angle = auto.TO_ANGLE | {"UZSTOP": f"{{3: {math.radians(degrees)!r}}}"}
        auto.run_auto(work, "angle" + name, angle, ("half", auto.stop_label(work / "half")))
        shear = auto.SHEAR | {"DSMAX": 0.02, "RL1": 0.4}
        auto.run_auto(work, "u" + name, shear, ("angle" + name, auto.stop_label(work / ("angle" + name))))
    switched = auto.SHEAR | {"DSMAX": 0.02, "RL1": 0.4, "ISW": -1}
    auto.run_auto(work, "us", switched, ("u27", first_label(work / "u27", auto.BRANCH_POINT)))
    for name, (run, kind, _) in LOCI.items():
        auto.run_auto(work, folder_of(name), LOCUS, (run, first_label(work / run, kind)))


def read_curve(folder):
    """Points [dD, psi0] of a locus."""
    lines = (folder / "fort.7").read_text().splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.startswith("   0")]
    return [[float(row[4]), float(row[-1])] for row in rows]


def follow(work, name, case):
    """Time one locus."""
    start = folder_of(name)
    settings = LOCUS | {"DS": LOCI[name][2]} | CASES[case]
    seconds, output = auto.run_auto(work, "locus", settings, (start, last_label(work / start)))
    curve = read_curve(work / "locus")
    if len(curve) < POINTS:
        raise SystemExit(f"AUTO stopped on the locus of {name} after {len(curve)} points: {auto.last_words(output)}")
    return {"cpu_seconds": seconds, "points": len(curve), "curve": curve}


def branch_points(work, case):
    """Shears of all branch points that AUTO reports on U at 15 degrees up to the shear `FALSE_LIMIT`."""
    settings = auto.SHEAR | {"DSMAX": 0.02, "RL1": FALSE_LIMIT} | CASES[case]
    auto.run_auto(work, "u", settings, ("angle15", auto.stop_label(work / "angle15")))
    return [value for kind, _, value, _ in auto.read_branch(work / "u") if kind == auto.BRANCH_POINT]


def measure(work, case):
    """Time both loci with the settings of a case and return the JSON object of the benchmark."""
    return {
        "name": f"AUTO-07p, {case}",
        "version": "bifpy " + importlib.metadata.version("bifpy"),
        "settings": {"DSMAX": LOCUS["DSMAX"]} | CASES[case],
        "loci": {name: follow(work, name, case) for name in LOCI},
        "limit": FALSE_LIMIT,
        "branch_points": branch_points(work, case),
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
