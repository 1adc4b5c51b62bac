"""The table of the benchmark of sizes as plain text."""

import statistics

import numpy as np

import report

HEADER = ("problem", "unknowns", "points", "intervals", "CPU s", "min - max", "ms/point", "grows as", "chord", "error")


def text(results, notes, rounds):
    """The report: CPU time over the number of unknowns.

    Parameters
    ----------
    results : dict from the name of a program to its runs, as JSON.
    notes : lines on what is missing.
    rounds : how often everything ran.
    """
    lines = [
        "Around the fold of n/2 coupled Bratu equations, n unknowns: neighbors in a chain, or all of a cluster.",
        "", *report.machine(), f"rounds    {rounds}; CPU s is the median, compilation excluded", "",
    ]  # fmt: skip
    runs = results.get("rodatlas", [])
    if runs:
        lines += [
            *report.aligned([HEADER, *_rows(runs)]), "",
            "grows as: exponent of n between this row and the one above; dense elimination costs n^3 per interval",
            "chord: CPU time with one factorization a step / with Newton's method, same run",
            "error: of the fold, against 3.513830719125",
        ]  # fmt: skip
    return "\n".join([*lines, *notes]) + "\n"


def _rows(runs):
    before = None
    for i in range(0, len(runs[0]), 2):
        first = runs[0][i]
        newton, chord = ([run[j]["cpu_seconds"] for run in runs] for j in (i, i + 1))
        seconds = statistics.median(newton)
        power = "-"
        if before is not None and before[0] == first["kind"]:
            power = f"n^{np.log(seconds / before[2]) / np.log(first['unknowns'] / before[1]):.1f}"
        before = (first["kind"], first["unknowns"], seconds)
        yield (
            first["kind"], str(first["unknowns"]), str(first["points"]), str(first["intervals"]), f"{seconds:.2f}",
            f"{min(newton):.2f} - {max(newton):.2f}", f"{1e3 * seconds / first['points']:.1f}", power,
            f"{statistics.median(chord) / seconds:.2f}", f"{max(run[i]['error'] for run in runs):.0e}",
        )  # fmt: skip
