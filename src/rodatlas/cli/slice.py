"""`rodatlas slice`: compute, print the table of stable states, write figures and data."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import json_target, note, progress_bar, settings_from, writable_folder
from rodatlas.cli.overlay import compare_overlay, read_overlay
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas import Slice


def run(setting: tuple[str, ...], out: str, json_to: str, fresh: bool, overlay: str = "", band: str = "") -> None:
    """The command; texts come as typed and are checked here, those of `setting` by `settings_from`."""
    settings = settings_from(*setting)
    measured = read_overlay(overlay, band, settings)
    folder = writable_folder(out)
    json_file = json_target(json_to)
    from rodatlas.atlas.slices.cache import write_text
    from rodatlas.atlas.slices.obtain import obtain_slice, stem_of

    stem = stem_of(settings)
    with progress_bar(f"slice at {settings.angle_deg:g} deg") as report:
        found = obtain_slice(settings, folder, report, fresh=fresh, say=note)
        report("figures", len(found.branches), 0)
        files = [*_figures(found, folder, stem), folder / f"{stem}.json", folder / f"{stem}.h5"]
    text = json.dumps(found.to_json(), indent=1) + "\n"
    write_text(folder / f"{stem}.json", text)
    console = Console(stderr=json_to == "-")
    say_table(console, _table(found))
    if measured:
        compared = compare_overlay(found, measured, folder / f"{stem}-overlay", console)
        text = json.dumps(found.to_json() | {"overlay": compared.to_json()}, indent=1) + "\n"
    for warning in found.remarks:
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    console.print(
        f"{len(found.branches)} branches, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    if json_to == "-":
        sys.stdout.write(text)
    elif json_file is not None:
        write_text(json_file, text)


def _figures(found: Slice, folder: Path, stem: str) -> list[Path]:
    """Draw the diagram and the profiles; the files written."""
    from rodatlas.atlas import coexisting_states
    from rodatlas.plot import draw_profiles, draw_slice_figure, save_figure

    written = [*save_figure(draw_slice_figure(found), folder / f"{stem}-diagram")]
    written += save_figure(draw_profiles(coexisting_states(found)), folder / f"{stem}-profiles")
    return written


def _table(found: Slice) -> Table:
    """Stable states: name, range of shear, and what ends each."""
    table = Table(
        title=f"Stable states at angle {found.settings.angle_deg:g} deg, dL = {found.settings.compression:g}, "
        f"nu = {found.settings.poisson:g}"
    )
    for name in ("state", "shear", "begins at", "ends at"):
        table.add_column(name, no_wrap=True)
    for s in found.states:
        table.add_row(s.name, f"{s.low.shear: .5f} to {s.high.shear:.5f}", s.low.text, s.high.text)
    return table
