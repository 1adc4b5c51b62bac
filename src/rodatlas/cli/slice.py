"""`rodatlas slice`: compute, print the table of stable states, write figures and data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import note, progress_bar
from rodatlas.cli.controls import Fixed
from rodatlas.cli.output import JsonTarget, json_text, writable_folder, write_own_json
from rodatlas.cli.overlay import compare_overlay, overlay_mark, read_overlay
from rodatlas.cli.setting import Range, slice_settings_from
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas import Slice

ENDS = {
    "range": "range: the range that was looked at ends there",
    "smooth": "smooth: the state becomes the next one without a bifurcation",
}


def run(
    fixed: Fixed, where: Range, tol: str, search: str, out: str, json_to: JsonTarget, fresh: bool, overlay: str | None,
    band: str | None,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    fixed, where : see :func:`rodatlas.cli.setting.slice_settings_from`.
    """
    settings = slice_settings_from(fixed, tol, search, where)
    measured = read_overlay(overlay, band, settings)
    mark = overlay_mark(overlay, band) if overlay is not None else ""
    identity = settings.identity() | ({"overlay": mark} if mark else {})
    from rodatlas.atlas.slices.obtain import obtain_slice

    stem = settings.stem
    compared_to = f"{stem}-overlay-{mark}"
    json_to.expect(identity, [Path(out) / f"{name}.json" for name in (stem, compared_to)] if mark else ())
    folder = writable_folder(out)
    with progress_bar(f"slice at {settings.place_text}") as report:
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
    """Draw the diagram, and the profiles of states that have a shape; the files written."""
    from rodatlas.atlas import coexisting_states
    from rodatlas.plot import colors_of, draw_profiles, draw_slice_figure, save_figure

    written = [*save_figure(draw_slice_figure(found), folder / f"{stem}-diagram")]
    model = found.settings.model
    read = model.ribbon
    if found.states and read is not None:
        rods = {name: read(x) for name, x in coexisting_states(found).items()}
        profiles = draw_profiles(rods, colors_of(found), model.controls)
        written += save_figure(profiles, folder / f"{stem}-profiles")
    return written


def _table(found: Slice) -> Table:
    """Stable states: name, range, response where that was chosen, what ends each, and where its band touches itself."""
    from rodatlas.atlas.slices.states.contact import ranges_text

    settings = found.settings
    quantity = settings.model.quantity(settings.against)
    chosen = quantity is not settings.model.quantities[0]
    table = Table(title=f"Stable states at {settings.place_text}")
    touching = any(s.contact for s in found.states)
    seen = [f"{quantity.name} there"] if chosen else []
    for name in ("state", settings.along, *seen, "begins at", "ends at", *(["touches itself"] if touching else [])):
        table.add_column(name, no_wrap=name != "touches itself")
    for s in found.states:
        responses = [f"{s.low.response: .5g} to {s.high.response:.5g}"] if chosen else []
        row = (s.name, f"{s.low.value: .5f} to {s.high.value:.5f}", *responses, s.low.text, s.high.text)
        table.add_row(*row, *([ranges_text(s.contact)] if touching else []))
    ends = {end.kind for s in found.states for end in (s.low, s.high)}
    notes = [text for kind, text in ENDS.items() if kind in ends]
    if quantity.conjugate == settings.along:
        notes.append(quantity.conjugate_text)
    table.caption = "; ".join(notes) or None
    return table
