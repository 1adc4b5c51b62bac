"""`rodatlas phase`: the plane of two controls with its loci, regions of stability and events."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import (
    WORKERS,
    note,
    number,
    progress_bar,
    whole_number,
)
from rodatlas.cli.controls import Fixed
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.setting import plane_from, with_unit
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.phase.result import PhaseDiagram
    from rodatlas.atlas.phase.settings import PhaseSettings


def run(
    fixed: Fixed, where: str | None, angle_min: str | None, angle_max: str | None, tol: str, workers: str, out: str,
    json_to: JsonTarget, fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    fixed, where : see :func:`rodatlas.cli.setting.plane_from`.
    """
    from rodatlas.atlas.phase.obtain import obtain_phase

    settings = phase_settings_from(fixed, where, angle_min, angle_max, tol)
    count = whole_number("workers", workers, WORKERS)
    json_to.expect(settings.identity())
    folder = writable_folder(out)
    with progress_bar("phase") as report:
        found = obtain_phase(settings, folder, report, workers=count, fresh=fresh, say=note)
        report("figures", len(found.places), 0)
        files = _files(found, folder)
    _say(found, files, Console(stderr=json_to.on_stdout))
    json_to.write(json_text(found.to_json(), settings.identity(), None), settings.identity())


def phase_settings_from(
    fixed: Fixed, where: str | None, angle_min: str | None, angle_max: str | None, tol: str
) -> PhaseSettings:
    """Settings of a plane of a model."""
    from rodatlas.atlas.phase.settings import PhaseSettings
    from rodatlas.paper.model import angle_window

    plane = plane_from(fixed, where)
    texts = {"angle-min": angle_min, "angle-max": angle_max}
    ends = {name: number(name, text) for name, text in texts.items() if text is not None}
    for name, value in ends.items():
        if plane.second != "angle":
            raise ValueError(f"{name}: expected none for the plane of {plane.second} and {plane.along}, got {value:g}")
    whole = PhaseSettings.of(
        plane.model, along=plane.along, second=plane.second, against=None, tolerance=number("tol", tol), **plane.fixed
    )
    return angle_window(whole, ends.get("angle-min"), ends.get("angle-max")) if ends else whole


def _files(found: PhaseDiagram, folder: Path) -> list[Path]:
    """Draw the figures and write the data as JSON; the files that are there now."""
    from rodatlas.paper.phase import PANELS, close_ups_of
    from rodatlas.plot import draw_phase_figure, draw_phase_states, save_figure

    stem = found.settings.stem
    text = folder / f"{stem}.json"
    identity = found.settings.identity()
    write_own_json(text, json_text(found.to_json(), identity, None), identity)
    figures = [*save_figure(draw_phase_figure(found, close_ups_of(found.settings)), folder / stem)]
    figures += save_figure(draw_phase_states(found, PANELS), folder / f"{stem}-states")
    return [*figures, text, folder / f"{stem}.h5"]


def _say(found: PhaseDiagram, files: list[Path], console: Console) -> None:
    settings, of = found.settings, found.settings.place_text
    names = with_unit(settings.second_control), with_unit(settings.along_control)
    events = Table(title=f"Special points of the plane, {of}")
    for name in (*names, "loci", "what happens"):
        events.add_column(name, no_wrap=name != "what happens")
    for e in (e for e in found.events if e.parameter != settings.along):
        status = "" if e.status == "converged" else f" ({e.status})"
        place = (f"{e.second:.4f}", f"{round(e.value, 6) + 0.0:.6f}")
        events.add_row(*place, ", ".join(e.labels), e.description + status)
    say_table(console, events)
    regions = Table(title=f"Regions of stability, {of}")
    for name in ("state", *names, "bounded by"):
        regions.add_column(name, no_wrap=name != "bounded by")
    for region in (r for name in found.names for r in found.state_regions(name)):
        low, high = region.rings[0].min(axis=0), region.rings[0].max(axis=0)
        ranges = (f"{low[0]:.4g} to {high[0]:.4g}", f"{low[1]:.4f} to {high[1]:.4f}")
        regions.add_row(region.state, *ranges, ", ".join(dict.fromkeys(region.bounds)))
    for i in (i for i in found.edge if not found.state_regions(i.name)):
        regions.add_row(i.name, f"{i.second:g}", f"{i.low:.4f} to {i.high:.4f}", "")
    say_table(console, regions)
    for line in found.completed:
        console.print(f"completed: {line}", markup=False, highlight=False)
    for warning in found.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)
    thin = sum(not f.samples for f in found.faces)
    console.print(
        f"{len(found.lines)} lines, {len(found.faces)} faces ({thin} too thin to be sampled), {len(found.places)} "
        f"slices, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
