"""`rodatlas export`: tables and shapes of a result file for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from rodatlas.cli.common import SAMPLES, note, number, progress_bar, shown, whole_number
from rodatlas.cli.output import file_target, place_files
from rodatlas.states.labels import in_file_name

if TYPE_CHECKING:
    import pandas as pd

    from rodatlas.atlas.contents import StatesTable
    from rodatlas.atlas.results import Result
    from rodatlas.continuation import Solution

MOST = 1e6  # size of a value of what varies: a slip of the keyboard
FORMATS = ("csv", "vtp", "glb", "stl")


@dataclass(frozen=True)
class Size:
    """How large shapes are written: width and thickness over the length, the length, and the unit it is in."""

    width: float
    thickness: float | None = None
    length: float = 1.0
    unit: str = "L"


def run(
    file: str, form: str | None, out: str, width: str | None, band: str | None, state: str | None, at: str | None,
    samples: str, sampled: bool, overwrite: bool,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    sampled : whether the samples were asked for, and are not the default.
    overwrite : whether other files may be replaced.
    """
    path = file_target(out)
    wanted = _format(form, out)
    target = path if path.suffix.lower() == f".{wanted}" else path.with_name(f"{path.name}.{wanted}")
    size, count = _size(width, band, wanted), whole_number("samples", samples, SAMPLES)
    place = number("at", at, -MOST, MOST) if at is not None else None
    if state is not None and not state.strip():
        raise ValueError(f"state: expected a name, got '{state}'")
    from rodatlas.atlas.contents import read_states_table
    from rodatlas.atlas.open import open_result

    with progress_bar("export", lines=False):
        found = read_states_table(file) if Path(file).suffix == ".json" else open_result(file)
        if wanted == "csv":
            frames, comments = _tables(found, state or "", place, count, sampled)
            written = place_files(target, lambda at: _written(frames, comments, at, size), overwrite)
        else:
            shapes = _solutions(found, state or "", place)
            colors = _colors(found)
            written = place_files(target, lambda at: _shapes(shapes, colors, wanted, at, size, count), overwrite)
    Console().print("wrote " + ", ".join(map(str, written)), highlight=False, soft_wrap=True, markup=False)


def _format(form: str | None, out: str) -> str:
    """The format asked for, or that of the file's name."""
    ending = Path(out).suffix.lower().removeprefix(".")
    wanted = ending if form is None else form.lower()
    if wanted not in FORMATS:
        got = f"the file name '{shown(out)}' and no --format" if form is None else f"'{shown(form)}'"
        raise ValueError(f"format: expected one of {', '.join(FORMATS)}, got {got}")
    if ending in FORMATS and ending != wanted:
        raise ValueError(f"format: expected {ending}, as the file '{shown(out)}' is called, got '{form}'")
    return wanted


def _size(width: str | None, band: str | None, wanted: str) -> Size:
    from rodatlas.rods.band import Band, ratio_from_text

    if width is not None and band is not None:
        raise ValueError(f"width: expected no --width beside --band, which has one, got '{shown(width)}'")
    if width is not None and wanted == "csv":
        raise ValueError(f"width: expected no --width for tables, which have none, got '{shown(width)}'")
    if band is not None:
        real = Band.from_text(band)
        return Size(real.aspect, real.thickness / real.length, real.length, "mm")
    if wanted == "stl":
        raise ValueError("band: expected LENGTHxWIDTHxTHICKNESS in mm for STL, which needs a thickness, got none")
    return Size(ratio_from_text("1/80" if width is None else width))


def _tables(
    found: Result | StatesTable, state: str, place: float | None, samples: int, sampled: bool
) -> tuple[dict[str, pd.DataFrame], list[str]]:
    """Tables by name, and comment lines for them."""
    from rodatlas.atlas.contents import shapes_of, tables_of
    from rodatlas.continuation import Solution

    if state:
        (found,) = shapes_of(found, state, place).values()
    elif place is not None:
        raise ValueError("at: expected --state beside --at for a table, got none")
    if sampled and not isinstance(found, Solution):
        raise ValueError(f"samples: expected --samples only for the table of one state, got {samples} with {found!r}")
    return tables_of(found, samples)


def _written(frames: Mapping[str, pd.DataFrame], comments: list[str], target: Path, size: Size) -> list[Path]:
    """Write tables: a single one into the target, several beside each other with their names added."""
    from rodatlas.plot.exports import with_millimeters, write_csv

    written = []
    for name, frame in frames.items():
        table = with_millimeters(frame, size.length) if size.unit == "mm" else frame
        path = target.with_name(f"{target.stem}-{name}{target.suffix}") if name else target
        written.append(write_csv(path, table, comments))
    return written


def _solutions(found: Result | StatesTable, state: str, place: float | None) -> dict[str, Solution]:
    """The shapes to write, by name."""
    from rodatlas.atlas import Slice
    from rodatlas.atlas.contents import shapes_of

    shapes = shapes_of(found, state, place)
    if isinstance(found, Slice) and not state and place is None:
        value = found.settings.value(next(iter(shapes.values())))
        note(f"{found.settings.along} {value:g}, where most stable states coexist (--at chooses another)")
    return shapes


def _colors(found: Result | StatesTable) -> Mapping[str, str]:
    """Colors of shapes by name: as in the figures of a slice, or of the search for states of a band."""
    from rodatlas.atlas import Slice
    from rodatlas.paper.names.yu_hanna import COLORS
    from rodatlas.plot.look.style import colors_of

    return colors_of(found) if isinstance(found, Slice) else COLORS


def _shapes(
    solutions: Mapping[str, Solution], colors: Mapping[str, str], wanted: str, target: Path, size: Size, samples: int
) -> list[Path]:
    """Write shapes: all into one scene of GLB, one file for each of other formats."""
    from rodatlas.plot import color_of
    from rodatlas.plot.band.surface import band_surface
    from rodatlas.plot.exports import box, point_fields, sheet, write_glb, write_stl, write_vtp

    surfaces = {name: band_surface(s, size.width, samples) for name, s in solutions.items()}
    if wanted == "glb":
        meshes = {}
        for name, surface in surfaces.items():
            digits = color_of(name or None, colors).lstrip("#")
            red, green, blue = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
            meshes[name or "band"] = (sheet(surface, size.length), (red, green, blue))
        return [write_glb(target, meshes, 1e-3 if size.unit == "mm" else 1.0)]
    written: list[Path] = []
    for name, surface in surfaces.items():
        path = _beside(target, name, written) if len(surfaces) > 1 else target
        if wanted == "vtp":
            fields = point_fields(solutions[name], surface.s, size.length, size.unit)
            written.append(write_vtp(path, sheet(surface, size.length), fields))
        else:
            assert size.thickness is not None
            mesh = box(surface, size.thickness, size.length)
            written.append(write_stl(path, mesh, f"rodatlas {name} in {size.unit}"))
    return written


def _beside(target: Path, name: str, taken: Sequence[Path]) -> Path:
    """The target with a name added; a number too where the names differ only in case (w and W)."""
    path = target.with_name(f"{target.stem}-{in_file_name(name)}{target.suffix}") if name else target
    if str(path).lower() in {str(p).lower() for p in taken}:
        path = path.with_name(f"{path.stem}-2{path.suffix}")
    return path
