"""`rodatlas loci`: bifurcations followed in clamp angle and shear, their special points, a figure and data."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import json_target, number, progress_bar, writable_folder
from rodatlas.cli.slice import slice_from, stem_of

if TYPE_CHECKING:
    from rodatlas.atlas.loci.result import Loci, LociSettings
    from rodatlas.atlas.slices.result import Slice
    from rodatlas.cli.common import Report


def run(
    numbers: Sequence[str], angle_max: str, compression: str, poisson: str, tol: str, out: str, json_to: str,
    fresh: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here."""
    from rodatlas.atlas.loci.compute import KNOWN, check_numbers
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
        found = _loci(settings, wanted or KNOWN, folder, fresh, report)
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


def _loci(settings: LociSettings, wanted: tuple[int, ...], folder: Path, fresh: bool, report: Report) -> Loci:
    """The loci from their data file, or computed from slices (which are read where they are) and written there."""
    from rodatlas.atlas.loci.compute import compute_loci
    from rodatlas.atlas.loci.store import stored_loci

    data = folder / f"{_stem(settings)}.h5"
    known = None if fresh else stored_loci(data, settings, wanted)
    if known is not None:
        print(f"read from {data} (--fresh computes everything again)", file=sys.stderr)
        return known

    def slice_of(angle: float) -> Slice:
        at = settings.slice_at(angle)
        return slice_from(at, folder / f"{stem_of(at)}.h5", fresh, report)

    found = compute_loci(settings, slice_of, wanted, report)
    found.save(data)
    return found


def _stem(settings: LociSettings) -> str:
    """Name of the files: what differs from dL = 1/2, nu = 1/4 and 80 degrees."""
    stem = stem_of(settings.slice_at(15.0)).removeprefix("slice-15")
    return f"loci{stem}" + (f"-to{settings.angle_max:g}" if settings.angle_max != 80.0 else "")


def _files(found: Loci, wanted: tuple[int, ...], folder: Path) -> list[Path]:
    """Draw the figure and write the data as JSON; the files that are there now."""
    from rodatlas.atlas.slices.cache import write_text
    from rodatlas.plot import draw_loci_figure, save_figure

    stem = _stem(found.settings)
    text = folder / f"{stem}.json"
    write_text(text, json.dumps(found.to_json(), indent=1) + "\n")
    return [*save_figure(draw_loci_figure(found, wanted), folder / stem), text, folder / f"{stem}.h5"]


def _say(found: Loci, wanted: tuple[int, ...], files: list[Path], console: Console) -> None:
    table = Table(title=f"Special points of loci, dL = {found.settings.compression:g}, nu = {found.settings.poisson:g}")
    for name in ("locus", "angle [deg]", "shear", "event", "with", "what happens"):
        table.add_column(name, no_wrap=name != "what happens")
    for piece in sorted((p for p in found.pieces if p.number is not None), key=lambda p: p.number or 0):
        if wanted and piece.number not in wanted:
            continue
        for e in piece.events:
            turn = {"psi0": " in angle", "dD": " in shear"}.get(e.event.parameter, "")
            status = "" if e.event.status.value == "converged" else f" ({e.event.status.value})"
            what = f"at fixed shear, {e.event.what}" if e.event.parameter == "dD" else e.event.what
            table.add_row(
                f"{piece.kind} {piece.number}", f"{e.angle_deg:.4f}", f"{e.shear:.6f}", e.event.kind + turn + status,
                ", ".join(map(str, e.numbers)), what,
            )  # fmt: skip
    console.print(table)
    for warning in found.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False)
    console.print(
        f"{len(found.curves)} curves, computed in {found.seconds:.1f} s; files: {', '.join(map(str, files))}",
        highlight=False, soft_wrap=True,
    )  # fmt: skip
