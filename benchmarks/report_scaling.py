"""The table of the benchmark of studies as plain text."""

import statistics

import report


def _spread(values):
    return f"{statistics.median(values):7.2f}  ({min(values):.2f} - {max(values):.2f})"


def text(results, notes, rounds):
    """The report: slices one by one, then all of them by one and by two processes.

    Parameters
    ----------
    results : dict from the name of a program to its runs, as JSON.
    notes : lines on what is missing.
    rounds : how often everything ran.
    """
    lines = ["Slices one by one, and several of them by 1 and 2 processes", "", *report.machine(), ""]
    runs = results.get("rodatlas", [])
    if runs:
        lines += [*_slices(runs), "", *_studies(runs), ""]
    lines += [f"medians and range of {rounds} rounds; one round runs each study once, 1 and 2 processes in turn"]
    load = [run["load"] for run in runs if run["load"] is not None]
    if load:
        lines.append(f"load of the machine before a round: {min(load):.1f} to {max(load):.1f}")
    return "\n".join([*lines, *notes]) + "\n"


def _slices(runs):
    lines = ["slice (dL 1/2, nu 1/4), one process, wall s"]
    for i, first in enumerate(runs[0]["slices"]):
        seconds = [run["slices"][i]["seconds"] for run in runs]
        what = f"{first['branches']} branches, {first['states']} states"
        lines.append(f"  {first['angle']:5g} deg  {_spread(seconds)}  {what}")
    return lines


def _studies(runs):
    """Wall time of the studies, and how much faster two processes are, round by round."""
    count = len(runs[0]["studies"][0]["task_seconds"])
    lines = [f"study of {count} slices at 15 deg, nu 0.1 to 0.35, from no file to the last one, wall s"]
    for i, first in enumerate(runs[0]["studies"]):
        seconds = [run["studies"][i]["wall_seconds"] for run in runs]
        cpu = [run["studies"][i]["cpu_seconds"] for run in runs]
        plural = "process  " if first["workers"] == 1 else "processes"
        lines.append(f"  {first['workers']} {plural}  {_spread(seconds)}  CPU s of the workers {_spread(cpu).strip()}")
    ratios = [run["studies"][0]["wall_seconds"] / run["studies"][-1]["wall_seconds"] for run in runs]
    lines.append(f"  speed-up     {_spread(ratios)}")
    return lines
