"""`rodatlas slice`: compute, print the table of stable states, write figures and data."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import json_target, progress_bar, settings_from, writable_folder

if TYPE_CHECKING:
    from rodatlas.atlas import Slice, SliceSettings
    from rodatlas.atlas.slices.follow import Progress as Report


def run(
    angle: str, compression: str, poisson: str, shear_max: str, tol: str, out: str, json_to: str, fresh: bool
) -> None:
    """The command; texts come as typed and are checked here."""
    settings = settings_from(angle, compression, poisson, tol, shear_max)
    folder = writable_folder(out)
    json_file = json_target(json_to)
    from rodatlas.atlas.slices.cache import write_text

    stem = stem_of(settings)
    data = folder / f"{stem}.h5"
    with progress_bar(f"slice at {settings.angle_deg:g} deg") as report:
        found = slice_from(settings, data, fresh, report)
        report("figures", len(found.branches), 0)
        files = [*_figures(found, folder, stem), folder / f"{stem}.json", data]
    text = json.dumps(found.to_json(), indent=1) + "\n"
    write_text(folder / f"{stem}.json", text)
    console = Console(stderr=json_to == "-")
    console.print(_table(found))
    for warning in found.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)
    console.print(
        f"{len(found.branches)} branches, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    if json_to == "-":
        sys.stdout.write(text)
    elif json_file is not None:
        write_text(json_file, text)


def slice_from(settings: SliceSettings, data: Path, fresh: bool, report: Report) -> Slice:
    """The slice from its data file, or computed and written there; what an interrupted run has finished is used."""
    from rodatlas.atlas import FolderCache, compute_slice
    from rodatlas.atlas.slices.store import stored_slice

    known = None if fresh else stored_slice(data, settings)
    if known is not None:
        print(f"read from {data} (--fresh computes everything again)", file=sys.stderr)
        return known
    cache = FolderCache(data.with_suffix(""), settings, fresh)
    if len(cache):
        print(f"resuming: {len(cache)} finished branches in {cache.folder}", file=sys.stderr)
    try:
        found = compute_slice(settings, cache, report)
    except KeyboardInterrupt:
        print(f"interrupted: {len(cache)} finished branches are kept in {cache.folder}; the same command resumes",
              file=sys.stderr)  # fmt: skip
        raise
    found.save(data)
    cache.clear()
    return found


def stem_of(settings: SliceSettings) -> str:
    """Name of the files: the angle, and what differs from dL = 1/2 and nu = 1/4."""
    other = f"-dL{settings.compression:g}" if settings.compression != 0.5 else ""
    other += f"-nu{settings.poisson:g}" if settings.poisson != 0.25 else ""
    return f"slice-{settings.angle_deg:g}{other}"


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
