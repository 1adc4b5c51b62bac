"""The table of the benchmark of the search for states as plain text."""

import statistics

import report


def _median(runs, *path):
    """Median over the runs of one number in their JSON objects."""
    values = []
    for run in runs:
        for key in path:
            run = run[key]
        values.append(run)
    return statistics.median(values)


def _kernel_rows(runs):
    rows = [("setting", "relaxed/s", "solved/s", "iterations", "segments", "error of force", "largest |N|")]
    for name, last in runs[-1]["kernels"].items():
        rows.append((
            name, f"{_median(runs, 'kernels', name, 'relaxed_per_second'):.0f}",
            f"{_median(runs, 'kernels', name, 'solved_per_second'):.0f}", f"{last['iterations']:.1f}",
            str(last["segments"]), f"{last['error_of_force'][0]:.0e}, {last['error_of_force'][1]:.0e}",
            f"{last['largest_force']:.0f}",
        ))  # fmt: skip
    return rows


def _search_rows(runs):
    rows = [("search", "CPU s", "starts", "converged", "listed", "wound up", "unseen", "new next")]
    for kind in ("stable", "all"):
        for name, last in runs[-1][kind].items():
            rows.append((
                f"{kind}: {name}", f"{_median(runs, kind, name, 'cpu_seconds'):.1f}", str(last["starts"]),
                str(last["converged"]), str(last["distinct"]), str(last["wound_left_out"]),
                f"{last['unseen_estimate']:.1f}", f"{last['unseen_probability']:.2%}",
            ))  # fmt: skip
    return rows


def text(results, notes, rounds):
    """The whole report.

    Parameters
    ----------
    results : dict of str to list of dict
        JSON objects of every run, under "rodatlas".
    notes : list of str
        What was left out, and why.
    rounds : int
        How often the program ran.
    """
    runs = results.get("rodatlas", [])
    lines = [
        "Search for equilibria at one setting: a = 0.625, dL = 0.5; angle and shear as named.", "",
        *report.machine(), f"rounds    {rounds}; medians; CPU time of one thread, compilation excluded", "",
    ]  # fmt: skip
    if runs:
        last, wall = runs[-1]["command"], _median(runs, "command", "wall_seconds")
        lines += [
            *report.aligned(_kernel_rows(runs)), "",
            "relaxed/s: random bands brought to a minimum of the energy, per second of one core",
            "solved/s: boundary value problems solved from n and m(0) that are off by 2 percent, the same",
            "error of force: relative, median and largest, against four times the steps", "",
            *report.aligned(_search_rows(runs)), "",
            "both classes; a +/- pair counts once; unseen: estimated number of states that the search missed;",
            "new next: probability that one more solution is a new state", "",
            f"`rodatlas states --angle 30 --shear 0.625 --stable-only`: {wall:.1f} s wall, start-up included, "
            f"{last['threads']} threads; {last['states']} states", "",
        ]  # fmt: skip
    return "\n".join(lines + [f"left out: {note}" for note in notes]).rstrip() + "\n"
