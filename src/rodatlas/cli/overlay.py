"""Measured ranges beside a slice: reading them before the work, comparing and drawing them after it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from rodatlas.cli.common import shown
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rich.console import Console

    from rodatlas.atlas import Slice, SliceSettings
    from rodatlas.atlas.experiments.comparison import Comparison, EndCheck
    from rodatlas.atlas.experiments.measured import Measurement


MOST_OF_NAME = 60  # characters of the name of measured data in those of files: systems take 255 bytes


def read_overlay(path: str | None, band: str | None, settings: SliceSettings) -> tuple[Measurement, ...]:
    """The measured ranges of a file, none without a file; whatever is wrong with them is told before any work."""
    if path is None:
        if band is not None:
            raise ValueError(f"band: expected --band only with --overlay, which it is for, got '{shown(band)}' alone")
        return ()
    from rodatlas.atlas.experiments.comparison import check_along_shear, converted
    from rodatlas.atlas.experiments.measured import read_measurements
    from rodatlas.rods.band import Band

    check_along_shear(settings)
    fixed = settings.setting
    measured = read_measurements(path, Band.from_text(band, fixed["poisson"]) if band is not None else None)
    converted(measured, fixed["compression"])
    return measured


def overlay_mark(path: str, band: str | None) -> str:
    """What stands for measured data and a band in the names of files: the file's name and eight digits of both."""
    content = hashlib.sha256(Path(path).read_bytes() + (band or "").encode()).hexdigest()[:8]
    return f"{Path(path).stem[:MOST_OF_NAME]}-{content}"


def compare_overlay(found: Slice, measured: Sequence[Measurement], stem: Path, console: Console) -> Comparison:
    """Print the comparison, and write it as JSON beside its figure."""
    from rodatlas.atlas.experiments.comparison import compare
    from rodatlas.files import write_text
    from rodatlas.plot import save_figure
    from rodatlas.plot.slices.overlay import draw_overlay

    compared = compare(found, measured)
    data = stem.with_name(f"{stem.name}.json")
    files = [*save_figure(draw_overlay(found, compared), stem), data]
    write_text(data, json.dumps(compared.to_json(), indent=1) + "\n")
    say_table(console, _table(compared))
    console.print(f"measured ranges: {', '.join(map(str, files))}", highlight=False, soft_wrap=True, markup=False)
    return compared


def _table(compared: Comparison) -> Table:
    """Both ends of each range: measured, computed, difference, error, and whether they agree."""
    unit = "parts of the limiting shear" if compared.normalized else "L"
    table = Table(
        title=f"Measured and computed ends, shear in {unit}", box=None, padding=(0, 1, 0, 0),
        caption="error: as given with the data; ~ estimated from clamps within 1 deg and 0.5 mm",
    )  # fmt: skip
    for name in ("state", "band", "end", "measured", "computed, at", "diff.", "error", "verdict"):
        table.add_column(name, justify="right" if name in ("measured", "diff.", "error") else "left")
    for check in compared.checks:
        for side, end in (("low", check.low), ("high", check.high)):
            table.add_row(check.measurement.state, check.measurement.label, side, *_cells(end))
    return table


def _cells(end: EndCheck) -> tuple[str, ...]:
    """The texts of one end, from 'measured' on."""
    at = end.kind if end.number is None else str(end.number)
    computed = "" if end.computed is None else f"{end.computed:.4f}, {at}"
    difference = "" if end.difference is None else f"{end.difference:+.4f}"
    error = "" if end.error is None else f"{'' if end.stated else '~'}{end.error:.4f}"
    return f"{end.measured:.4f}", computed, difference, error, end.verdict
