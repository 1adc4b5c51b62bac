"""`rodatlas phase`: the plane of clamp angle and shear with its loci, regions of stability and events."""

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
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.phase.result import PhaseDiagram


def run(
    angle_min: str, angle_max: str, compression: str, poisson: str, tol: str, workers: str, out: str,
    json_to: JsonTarget, fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here."""
    from rodatlas.atlas.phase.obtain import obtain_phase
    from rodatlas.atlas.phase.settings import PhaseSettings

    settings = PhaseSettings(
        number("compression", compression), number("poisson", poisson), number("angle-min", angle_min),
        number("angle-max", angle_max), number("tol", tol),
    )  # fmt: skip
    count = whole_number("workers", workers, WORKERS)
    json_to.expect(settings.identity())
    folder = writable_folder(out)
    with progress_bar("phase") as report:
        found = obtain_phase(settings, folder, report, workers=count, fresh=fresh, say=note)
        report("figures", len(found.angles), 0)
        files = _files(found, folder)
    _say(found, files, Console(stderr=json_to.on_stdout))
    json_to.write(json_text(found.to_json(), settings.identity(), None), settings.identity())


def _files(found: PhaseDiagram, folder: Path) -> list[Path]:
    """Draw the figures and write the data as JSON; the files that are there now."""
    from rodatlas.atlas.phase.settings import phase_stem_of
    from rodatlas.plot import draw_phase_figure, draw_phase_states, save_figure

    stem = phase_stem_of(found.settings)
    text = folder / f"{stem}.json"
    identity = found.settings.identity()
    write_own_json(text, json_text(found.to_json(), identity, None), identity)
    figures = [*save_figure(draw_phase_figure(found), folder / stem)]
    figures += save_figure(draw_phase_states(found), folder / f"{stem}-states")
    return [*figures, text, folder / f"{stem}.h5"]


def _say(found: PhaseDiagram, files: list[Path], console: Console) -> None:
    of = f"dL = {found.settings.compression:g}, nu = {found.settings.poisson:g}"
    events = Table(title=f"Special points of the plane, {of}")
    for name in ("angle [deg]", "shear", "loci", "what happens"):
        events.add_column(name, no_wrap=name != "what happens")
    for e in (e for e in found.events if e.parameter != "shear"):
        status = "" if e.status == "converged" else f" ({e.status})"
        place = (f"{e.angle_deg:.4f}", f"{round(e.shear, 6) + 0.0:.6f}")
        events.add_row(*place, ", ".join(e.labels), e.description + status)
    say_table(console, events)
    regions = Table(title=f"Regions of stability, {of}")
    for name in ("state", "angle [deg]", "shear", "bounded by"):
        regions.add_column(name, no_wrap=name != "bounded by")
    for region in (r for name in found.names for r in found.state_regions(name)):
        low, high = region.rings[0].min(axis=0), region.rings[0].max(axis=0)
        ranges = (f"{low[0]:.4g} to {high[0]:.4g}", f"{low[1]:.4f} to {high[1]:.4f}")
        regions.add_row(region.state, *ranges, ", ".join(dict.fromkeys(region.bounds)))
    for i in (i for i in found.edge if not found.state_regions(i.name)):
        regions.add_row(i.name, "0", f"{i.low:.4f} to {i.high:.4f}", "")
    say_table(console, regions)
    for line in found.completed:
        console.print(f"completed: {line}", markup=False, highlight=False)
    for warning in found.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)
    thin = sum(not f.samples for f in found.faces)
    console.print(
        f"{len(found.lines)} lines, {len(found.faces)} faces ({thin} too thin to be sampled), {len(found.angles)} "
        f"slices, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
