"""`rodatlas loci`: bifurcations followed in two controls, their special points, a figure and data."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import note, number, progress_bar, whole_number
from rodatlas.cli.controls import Fixed
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.setting import plane_from, with_unit
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.loci.result import Loci
    from rodatlas.atlas.loci.settings import LociSettings


def run(
    numbers: Sequence[str], fixed: Fixed, where: str | None, angle_max: str | None, tol: str, out: str,
    json_to: JsonTarget, fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    fixed, where : see :func:`rodatlas.cli.setting.plane_from`.
    """
    from rodatlas.atlas.loci.obtain import obtain_loci

    wanted = tuple(whole_number("number", text) for text in numbers)
    settings = loci_settings_from(fixed, where, angle_max, tol)
    settings.check_numbers(wanted)
    identity = settings.identity_of(wanted)
    json_to.expect(identity)
    folder = writable_folder(out)
    with progress_bar("loci") as report:
        found = obtain_loci(settings, folder, wanted, report, fresh=fresh, say=note)
        report("figures", len(found.curves), 0)
        files = _files(found, wanted, folder)
    _say(found, wanted, files, Console(stderr=json_to.on_stdout))
    json_to.write(json_text(found.to_json(wanted), identity), identity)


def loci_settings_from(fixed: Fixed, where: str | None, angle_max: str | None, tol: str) -> LociSettings:
    """Settings of loci of a model."""
    from rodatlas.atlas.loci.settings import LociSettings
    from rodatlas.paper.model import check_angle_max

    plane = plane_from(fixed, where)
    most = None if angle_max is None else number("angle-max", angle_max)
    if most is not None and plane.second != "angle":
        raise ValueError(f"angle-max: expected none for the plane of {plane.second} and {plane.along}, got {most:g}")
    if most is not None:
        check_angle_max(most)
    return LociSettings.of(
        plane.model, along=plane.along, second=plane.second, second_high=most, against=None,
        tolerance=number("tol", tol), **plane.fixed,
    )  # fmt: skip


def _files(found: Loci, wanted: tuple[int, ...], folder: Path) -> list[Path]:
    """Draw the figure and write the data as JSON; the files that are there now."""
    from rodatlas.plot import draw_loci_figure, save_figure

    stem = found.settings.stem(wanted)
    text = folder / f"{stem}.json"
    identity = found.settings.identity_of(wanted or found.wanted)
    write_own_json(text, json_text(found.to_json(wanted), identity), identity)
    data = next(d for d in (folder / f"{stem}.h5", folder / f"{found.settings.stem()}.h5") if d.exists())
    return [*save_figure(draw_loci_figure(found, wanted), folder / stem), text, data]


def _say(found: Loci, wanted: tuple[int, ...], files: list[Path], console: Console) -> None:
    settings = found.settings
    table = Table(title=f"Special points of loci, {settings.place_text}")
    names = (with_unit(settings.second_control), with_unit(settings.along_control), settings.against)
    for name in (*names, "loci", "what happens"):
        table.add_column(name, no_wrap=name != "what happens")
    for e in found.events():
        if not wanted or {str(n) for n in wanted} & set(e.labels):
            status = "" if e.status == "converged" else f" ({e.status})"
            place = (f"{e.second:.4f}", f"{round(e.value, 6) + 0.0:.6f}", f"{e.response:.6f}")
            table.add_row(*place, ", ".join(e.labels), e.description + status)
    say_table(console, table)
    for warning in found.remarks(wanted):
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    console.print(
        f"{len(found.curves)} curves, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
