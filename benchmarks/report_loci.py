"""The table of the benchmark of loci as plain text."""

import statistics

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

import report

NAMES = ("fold 12", "pitchfork 4")
HEADER = ("program", "locus", "CPU s", "min - max", "points", "length", "ms/point", "ratio", "distance")
BRANCH_POINTS = len(report.PITCHFORKS)  # on U at 15 degrees, up to the limiting shear


def distances(curve, ours):
    """Distance of each point of a curve from ours, where ours covers it.

    Our points (dD, psi0, arclength) are joined by a cubic spline in the arclength of the locus, which is smooth also
    where the curve has a cusp in the plane. Points that are nearest to an end of ours are left out.
    """
    ours = np.array(ours)
    spline = CubicSpline(ours[:, 2], ours[:, :2])
    fine = np.linspace(ours[0, 2], ours[-1, 2], 20 * len(ours))
    samples, found = spline(fine), []
    for point in np.array(curve)[:, :2]:
        i = int(np.argmin(((samples - point) ** 2).sum(axis=1)))
        if 0 < i < len(fine) - 1:
            best = minimize_scalar(
                lambda t, point=point: ((spline(t) - point) ** 2).sum(), bounds=(fine[i - 1], fine[i + 1]),
                method="bounded", options={"xatol": 1e-10},
            )  # fmt: skip
            found.append(float(np.sqrt(best.fun)))
    return found


def length(curve):
    """Length of a polygon in the plane of shear and angle in radians."""
    return float(np.linalg.norm(np.diff(np.array(curve)[:, :2], axis=0), axis=1).sum())


def per_point(runs, name):
    """Median CPU milliseconds for a point of a locus."""
    return 1e3 * statistics.median(run["loci"][name]["cpu_seconds"] / run["loci"][name]["points"] for run in runs)


def row(runs, name, ours):
    """One row of the table: a locus by one program; ``ours`` are our runs, or an empty list."""
    seconds = sorted(run["loci"][name]["cpu_seconds"] for run in runs)
    last = runs[-1]["loci"][name]
    ratio, apart = "-", "-"
    if ours:
        ratio = f"{per_point(ours, name) / per_point(runs, name):.3f}"
        if runs is not ours:
            apart = f"{max(distances(last['curve'], ours[-1]['loci'][name]['curve'])):.0e}"
    return (
        runs[-1]["name"], name, f"{statistics.median(seconds):.3f}", f"{seconds[0]:.3f} - {seconds[-1]:.3f}",
        str(last["points"]), f"{length(last['curve']):.3f}", f"{per_point(runs, name):.2f}", ratio, apart,
    )  # fmt: skip


def false_points(run):
    """A line on the branch points that a program reports on U."""
    found = run["branch_points"]
    return (
        f"{run['name']}: {len(found)} branch points on U up to dD = {run['limit']}, "
        f"{max(0, len(found) - BRANCH_POINTS)} of them false"
    )


def text(results, notes, rounds):
    """The whole report.

    Parameters
    ----------
    results : dict of str to list of dict
        JSON objects of every run, by program; "rodatlas" is the key of ours.
    notes : list of str
        What was left out, and why.
    rounds : int
        How often every program ran, in turn.
    """
    ours = results.get("rodatlas", [])
    ran = [runs for runs in results.values() if runs]
    lines = [
        "Loci of the perfectly anisotropic rod in the plane (dD, psi0): 13 equations, a = 0.625, dL = 0.5;",
        "fold 12 of US from psi0 = 27.5 deg, pitchfork 4 of U from 15 deg; 50 intervals of 4 Gauss points.",
        "",
        *report.machine(),
        f"rounds    {rounds}, programs in turn; CPU s (user + system) is the median; the way to the start excluded",
        "",
    ]
    if ran:
        table = [HEADER, *(row(runs, name, ours) for name in NAMES for runs in ran)]
        lines += [
            *report.aligned(table),
            "",
            "length: of the curve in the plane, psi0 in radians",
            "ratio: CPU time per point of rodatlas / that of this row, same run (below 1: rodatlas is faster)",
            "distance: largest one of a point from our curve, where ours covers it",
            "rodatlas also locates what happens on the way, included in its time (AUTO-07p does not):",
            *(f"  {name}: {', '.join(run['loci'][name]['events'])}" for run in ours[-1:] for name in NAMES),
            "",
            *(false_points(runs[-1]) for runs in ran),
            "",
        ]
    for runs in ran:
        if "settings" in runs[-1]:
            settings = ", ".join(f"{key} = {value}" for key, value in runs[-1]["settings"].items())
            lines.append(f"{runs[-1]['name']} ({runs[-1]['version']}): {settings}")
    return "\n".join(lines + [f"left out: {note}" for note in notes]).rstrip() + "\n"
