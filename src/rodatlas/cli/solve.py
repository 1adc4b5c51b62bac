"""`rodatlas solve`: one named state, its observables, and its files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import number, progress_bar, settings_from, writable_folder
from rodatlas.cli.tables import say_table
from rodatlas.rods.band import near_limit
from rodatlas.rods.ends import Ends
from rodatlas.states.labels import in_file_name, parse_label

if TYPE_CHECKING:
    from rodatlas.continuation import Solution


def run(angle: str, shear: str, state: str, out: str, compression: str, poisson: str, tol: str, folder: str) -> None:
    """The command; texts come as typed and are checked here."""
    value = number("shear", shear)
    settings = settings_from(angle, compression, poisson, tol)
    Ends(settings.angle_deg, settings.compression, value)
    parse_label(state)
    path = _target(out or f"out/{in_file_name(state)}-{settings.angle_deg:g}-dD{value:g}.h5")
    from rodatlas.atlas.slices.reach import reach
    from rodatlas.plot.exports import solution_table, write_csv

    if folder and not Path(folder).is_dir():
        raise ValueError(f"from: expected a folder with a slice, got '{folder}'")
    with progress_bar(f"{state} at {settings.angle_deg:g} deg, shear {value:g}") as report:
        solution, source = reach(settings, state, value, progress=report, folder=Path(folder or "out"))
    solution.save(path)
    table = path.with_suffix(".csv")
    write_csv(table, *solution_table(solution), bare=True)
    console = Console()
    say_table(console, _table(state, solution, source))
    if near := near_limit(value, settings.compression):
        console.print(f"warning: {near}", style="yellow", markup=False, soft_wrap=True)
    console.print(f"wrote {path} and {table}", highlight=False, soft_wrap=True)


def _target(text: str) -> Path:
    """The HDF5 file, checked before any work is done."""
    path = Path(text)
    if not text.strip() or path.is_dir():
        raise ValueError(f"out: expected a file name, got {f'the folder {text!r}' if text.strip() else repr(text)}")
    writable_folder(str(path.parent))
    return path.with_suffix(".h5")


def _table(name: str, solution: Solution, source: str) -> Table:
    from rodatlas.rods.stability import index_of
    from rodatlas.rods.state import RodState

    rod, index = RodState(solution), index_of(solution)
    bending, twist = rod.energy_parts
    drift = {k: float(np.ptp(v)) for k, v in rod.first_integrals.items()}
    rows = [
        ("state", f"{name} (from a {source})"),
        ("height int y ds", f"{rod.height:.9f} L"),
        ("energy", f"{rod.energy:.9f} GJ/L = {bending:.6f} bending + {twist:.6f} twist"),
        ("N(0), body", " ".join(f"{x:.8f}" for x in rod.force[0]) + " GJ/L^2"),
        ("M(0), body", " ".join(f"{x:.8f}" for x in rod.moment[0]) + " GJ/L"),
        ("Morse index", f"{index.index} ({'stable' if index.index == 0 else 'unstable'}; distance to singular "
                        f"{index.margin:.2e}){'' if index.trusted else ' not trusted: ' + index.reason}"),
        ("reversal-symmetric", "yes" if rod.symmetric else "no"),
        ("inflections", f"{rod.inflections['k1']} of k1, {rod.inflections['tau']} of tau"),
        ("estimated error", f"{solution.error:.1e} of each unknown's scale, {solution.intervals} intervals"),
        ("drift of first integrals", ", ".join(f"{k}: {v:.1e}" for k, v in drift.items())),
    ]  # fmt: skip
    table = Table(show_header=False)
    for row in rows:
        table.add_row(*row)
    return table
