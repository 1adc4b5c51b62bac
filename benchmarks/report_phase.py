"""The line of the benchmark of the phase diagram as plain text."""

import report


def text(results, notes, rounds):
    """The report; parameters as those of :func:`report_scaling.text`, with one round."""
    lines = ["Phase diagram (dL 1/2, nu 1/4, 0 to 80 deg, shear -0.1 to 0.86) from nothing", "", *report.machine(), ""]
    for run in results.get("rodatlas", []):
        lines.append(
            f"{run['workers']} processes: {run['seconds']:.0f} s wall for {run['slices']} slices, "
            f"{run['lines']} lines, {run['faces']} faces, {run['warnings']} warnings"
        )
        if run["load"] is not None:
            lines.append(f"load of the machine before: {run['load']:.1f}")
    return "\n".join([*lines, *notes]) + "\n"
