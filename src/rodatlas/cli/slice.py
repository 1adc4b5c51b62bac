"""`rodatlas slice`: compute, print the table of stable states, write figures and data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import note, progress_bar, settings_from
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.overlay import compare_overlay, overlay_mark, read_overlay
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas import Slice

ENDS = {
    "range": "range: the shears that were looked at end there",
    "smooth": "smooth: the state becomes the next one without a bifurcation",
}


def run(
    setting: tuple[str, str, str, str, str | None, str | None, str], out: str, json_to: JsonTarget, fresh: bool,
    overlay: str | None, band: str | None,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here, those of `setting` by `settings_from`."""
    settings = settings_from(*setting)
    measured = read_overlay(overlay, band, settings)
    mark = overlay_mark(overlay, band) if overlay is not None else ""
    identity = settings.identity() | ({"overlay": mark} if mark else {})
    from rodatlas.atlas.slices.obtain import obtain_slice, stem_of

    stem = stem_of(settings)
    compared_to = f"{stem}-overlay-{mark}"
    json_to.expect(identity, [Path(out) / f"{name}.json" for name in (stem, compared_to)] if mark else ())
    folder = writable_folder(out)
    with progress_bar(f"slice at {settings.angle_deg:g} deg") as report:
        found = obtain_slice(settings, folder, report, fresh=fresh, say=note)
        report("figures", len(found.branches), 0)
        files = [*_figures(found, folder, stem), folder / f"{stem}.json", folder / f"{stem}.h5"]
    text = json_text(found.to_json(), settings.identity())
    write_own_json(folder / f"{stem}.json", text, settings.identity())
    console = Console(stderr=json_to.on_stdout)
    say_table(console, _table(found))
    if measured:
        compared = compare_overlay(found, measured, folder / compared_to, console)
        text = json_text(found.to_json() | {"overlay": compared.to_json()}, identity)
    for warning in found.remarks:
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)
    console.print(
        f"{len(found.branches)} branches, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
    json_to.write(text, identity)


def _figures(found: Slice, folder: Path, stem: str) -> list[Path]:
    """Draw the diagram and the profiles; the files written."""
    from rodatlas.atlas import coexisting_states
    from rodatlas.plot import draw_profiles, draw_slice_figure, save_figure

    written = [*save_figure(draw_slice_figure(found), folder / f"{stem}-diagram")]
    written += save_figure(draw_profiles(coexisting_states(found)), folder / f"{stem}-profiles")
    return written


def _table(found: Slice) -> Table:
    """Stable states: name, range of shear, what ends each, and where its band touches itself."""
    from rodatlas.atlas.slices.contact import ranges_text

    table = Table(
        title=f"Stable states at angle {found.settings.angle_deg:g} deg, dL = {found.settings.compression:g}, "
        f"nu = {found.settings.poisson:g}"
    )
    touching = any(s.contact for s in found.states)
    for name in ("state", "shear", "begins at", "ends at", *(["touches itself"] if touching else [])):
        table.add_column(name, no_wrap=name != "touches itself")
    for s in found.states:
        row = (s.name, f"{s.low.shear: .5f} to {s.high.shear:.5f}", s.low.text, s.high.text)
        table.add_row(*row, *([ranges_text(s.contact)] if touching else []))
    ends = {end.kind for s in found.states for end in (s.low, s.high)}
    table.caption = "; ".join(text for kind, text in ENDS.items() if kind in ends) or None
    return table
