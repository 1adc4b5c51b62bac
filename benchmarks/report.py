"""The table of the U-branch benchmark as plain text."""

import datetime
import os
import platform
import statistics
import subprocess
from pathlib import Path

# MODEL: both pitchforks of the U branch at psi0 = 15 deg.
PITCHFORKS = (0.327675302, 0.616372198)
HEADER = (
    "program", "CPU s", "min - max", "points", "Newton", "ms/it.", "ms/point", "pitchforks dD", "error", "ratio"
)  # fmt: skip


def machine():
    """Lines that name the machine and the versions, without any path."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    try:
        output = subprocess.run(["gfortran", "--version"], capture_output=True, text=True, check=False).stdout
        compiler = output.splitlines()[0]
    except (OSError, IndexError):
        compiler = "no gfortran"
    return [
        f"date      {datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC",
        f"machine   {model}, {os.cpu_count()} logical CPUs, {platform.system()}; every program on one thread",
        f"versions  Python {platform.python_version()}; {compiler}",
    ]


def location_error(branch_points):
    """Largest error of the two pitchforks, or a word on what is wrong with the list."""
    if len(branch_points) != len(PITCHFORKS):
        return f"{len(branch_points)} found"
    worst = max(abs(a - b) for a, b in zip(sorted(branch_points), PITCHFORKS, strict=True))
    return f"{worst:.0e}" if worst < 1e-2 else "wrong"


def median(runs):
    """Median CPU seconds of a list of runs of one program."""
    return statistics.median(run["cpu_seconds"] for run in runs)


def row(runs, ours):
    """One row of the table from the runs of one program; ``ours`` is our median in seconds or None."""
    seconds, last = median(runs), runs[-1]
    spread = sorted(run["cpu_seconds"] for run in runs)
    return (
        last["name"],
        f"{seconds:.3f}",
        f"{spread[0]:.3f} - {spread[-1]:.3f}",
        str(last["points"]),
        str(last["newton_iterations"]),
        f"{1e3 * seconds / last['newton_iterations']:.2f}",
        f"{1e3 * seconds / last['points']:.2f}",
        " ".join(f"{value:.6f}" for value in last["branch_points"]),
        location_error(last["branch_points"]),
        "-" if ours is None else f"{ours / seconds:.2f}",
    )


def aligned(rows):
    """Rows of strings as lines with aligned columns, the first column to the left."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(r, widths, strict=True)))
            for r in rows]  # fmt: skip


def scipy_lines(runs):
    """The table of `solve_bvp`: one row per shear, medians over the runs."""
    rows = [("dD", "CPU s", "mesh nodes", "mesh rounds", "height")]
    for i, one in enumerate(runs[-1]["solutions"]):
        seconds = statistics.median(run["solutions"][i]["cpu_seconds"] for run in runs)
        cells = (f"{one['shear']:.2f}", f"{seconds:.3f}", one["nodes"], one["iterations"], f"{one['height']:.9f}")
        rows.append(tuple(map(str, cells)))
    each = statistics.median(one["cpu_seconds"] for run in runs for one in run["solutions"])
    title = f"SciPy {runs[-1]['version']} solve_bvp at fixed shears (no continuation, no detection)"
    return [title, *aligned(rows), f"median {each:.3f} CPU s per solution"]


def text(results, notes, rounds):
    """The whole report.

    Parameters
    ----------
    results : dict of str to list of dict
        JSON objects of every run, by program; "rodatlas" and "scipy" are the keys of those two.
    notes : list of str
        What was left out, and why.
    rounds : int
        How often every program ran, in turn.
    """
    ours = median(results["rodatlas"]) if results.get("rodatlas") else None
    rows = [HEADER, *(row(runs, ours) for name, runs in results.items() if name != "scipy" and runs)]
    lines = [
        "U branch of the perfectly anisotropic rod: 13 equations, a = 0.625, psi0 = 15 deg, dL = 0.5,",
        "dD from 0 to 0.79, folds and branch points located; 50 intervals of 4 Gauss points, tolerance 1e-7.",
        "",
        *machine(),
        f"rounds    {rounds}, programs in turn; CPU s (user + system) is the median; start-up and start state excluded",
        "",
    ]
    if len(rows) > 1:
        lines += [
            *aligned(rows),
            "",
            "ratio: CPU seconds of rodatlas / CPU seconds of this row, same run (below 1: rodatlas is faster)",
            f"error: of the two pitchforks, against {PITCHFORKS[0]} and {PITCHFORKS[1]}",
            "",
        ]
    rivals = [runs for name, runs in results.items() if name.startswith("auto") and runs]
    for runs in rivals:
        settings = ", ".join(f"{key} = {value}" for key, value in runs[-1]["settings"].items())
        lines.append(f"{runs[-1]['name']} ({runs[-1]['version']}): {settings}")
    right = [runs for runs in rivals if not location_error(runs[-1]["branch_points"])[-1].isalpha()]
    if right:
        lines += [f"fastest that finds both pitchforks: {min(right, key=median)[-1]['name']}", ""]
    if results.get("scipy"):
        lines += [*scipy_lines(results["scipy"]), ""]
    return "\n".join(lines + [f"left out: {note}" for note in notes]).rstrip() + "\n"
