"""`rodatlas loci`: bifurcations followed in clamp angle and shear, their special points, a figure and data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import note, number, progress_bar, whole_number
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.loci.result import Loci


def run(
    numbers: Sequence[str], angle_max: str, compression: str, poisson: str, tol: str, out: str,
    json_to: JsonTarget, fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here."""
    from rodatlas.atlas.loci.compute import check_numbers
    from rodatlas.atlas.loci.obtain import obtain_loci
    from rodatlas.atlas.loci.result import KNOWN, LociSettings

    wanted = tuple(whole_number("number", text) for text in numbers)
    check_numbers(wanted)
    settings = LociSettings(
        number("compression", compression), number("poisson", poisson), number("angle-max", angle_max),
        number("tol", tol),
    )  # fmt: skip
    identity = settings.identity_of(wanted or KNOWN)
    json_to.expect(identity)
    folder = writable_folder(out)
    with progress_bar("loci") as report:
        found = obtain_loci(settings, folder, wanted, report, fresh=fresh, say=note)
        report("figures", len(found.curves), 0)
        files = _files(found, wanted, folder)
    _say(found, wanted, files, Console(stderr=json_to.on_stdout))
    json_to.write(json_text(found.to_json(wanted), identity), identity)


def _files(found: Loci, wanted: tuple[int, ...], folder: Path) -> list[Path]:
    """Draw the figure and write the data as JSON; the files that are there now."""
    from rodatlas.atlas.loci.obtain import loci_stem_of
    from rodatlas.plot import draw_loci_figure, save_figure

    stem = loci_stem_of(found.settings, wanted)
    text = folder / f"{stem}.json"
    identity = found.settings.identity_of(wanted or found.wanted)
    write_own_json(text, json_text(found.to_json(wanted), identity), identity)
    data = next(d for d in (folder / f"{stem}.h5", folder / f"{loci_stem_of(found.settings)}.h5") if d.exists())
    return [*save_figure(draw_loci_figure(found, wanted), folder / stem), text, data]


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
