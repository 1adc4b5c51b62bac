"""`rodatlas loci`: bifurcations followed in clamp angle and shear, their special points, a figure and data."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import json_target, note, number, progress_bar, writable_folder
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.loci.result import Loci


def run(
    numbers: Sequence[str], angle_max: str, compression: str, poisson: str, tol: str, out: str, json_to: str,
    fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here."""
    from rodatlas.atlas.loci.compute import check_numbers
    from rodatlas.atlas.loci.obtain import obtain_loci
    from rodatlas.atlas.loci.result import LociSettings

    wanted = tuple(_whole(text) for text in numbers)
    check_numbers(wanted)
    settings = LociSettings(
        number("compression", compression), number("poisson", poisson), number("angle-max", angle_max),
        number("tol", tol),
    )  # fmt: skip
    folder = writable_folder(out)
    json_file = json_target(json_to)
    with progress_bar("loci") as report:
        found = obtain_loci(settings, folder, wanted, report, fresh=fresh, say=note)
        report("figures", len(found.curves), 0)
        files = _files(found, wanted, folder)
    text = json.dumps(found.to_json(wanted), indent=1) + "\n"
    _say(found, wanted, files, Console(stderr=json_to == "-"))
    if json_to == "-":
        sys.stdout.write(text)
    elif json_file is not None:
        from rodatlas.atlas.slices.cache import write_text

        write_text(json_file, text)


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"number: expected a whole number, got '{text}'") from None


def _files(found: Loci, wanted: tuple[int, ...], folder: Path) -> list[Path]:
    """Draw the figure and write the data as JSON; the files that are there now."""
    from rodatlas.atlas.loci.obtain import loci_stem_of
    from rodatlas.atlas.slices.cache import write_text
    from rodatlas.plot import draw_loci_figure, save_figure

    stem = loci_stem_of(found.settings)
    text = folder / f"{stem}.json"
    write_text(text, json.dumps(found.to_json(), indent=1) + "\n")
    return [*save_figure(draw_loci_figure(found, wanted), folder / stem), text, folder / f"{stem}.h5"]


def _say(found: Loci, wanted: tuple[int, ...], files: list[Path], console: Console) -> None:
    table = Table(title=f"Special points of loci, dL = {found.settings.compression:g}, nu = {found.settings.poisson:g}")
    for name in ("angle [deg]", "shear", "height", "loci", "what happens"):
        table.add_column(name, no_wrap=name != "what happens")
    for e in found.events():
        if not wanted or {str(n) for n in wanted} & set(e.labels):
            status = "" if e.status == "converged" else f" ({e.status})"
            place = (f"{e.angle_deg:.4f}", f"{round(e.shear, 6) + 0.0:.6f}", f"{e.height:.6f}")
            table.add_row(*place, ", ".join(e.labels), e.description + status)
    say_table(console, table)
    for warning in found.remarks(wanted):
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    console.print(
        f"{len(found.curves)} curves, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
