"""`rodatlas export`: tables and shapes of a result file for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from rodatlas.cli.common import note, number, writable_folder
from rodatlas.states.labels import in_file_name

if TYPE_CHECKING:
    from rodatlas.atlas.contents import StatesTable
    from rodatlas.atlas.open import Result
    from rodatlas.continuation import Solution

FORMATS = ("csv", "vtp", "glb", "stl")


@dataclass(frozen=True)
class Size:
    """How large shapes are written: width and thickness over the length, the length, and the unit it is in."""

    width: float
    thickness: float | None = None
    length: float = 1.0
    unit: str = "L"


def run(file: str, form: str, out: str, width: str, band: str, state: str, shear: str, samples: str) -> None:
    """The command; texts come as typed and are checked here."""
    wanted = _format(form, out)
    target = _target(out, wanted)
    size, count = _size(width, band, wanted), _samples(samples)
    place = number("shear", shear) if shear else None
    from rodatlas.atlas.contents import read_states_table
    from rodatlas.atlas.open import open_result

    found = read_states_table(file) if Path(file).suffix == ".json" else open_result(file)
    if wanted == "csv":
        written = _tables(found, state, place, target, size, count)
    else:
        written = _shapes(_solutions(found, state, place), wanted, target, size, count)
    Console().print("wrote " + ", ".join(map(str, written)), highlight=False, soft_wrap=True, markup=False)


def _format(form: str, out: str) -> str:
    """The format asked for, or that of the file's name."""
    wanted = form.lower() or Path(out).suffix.lower().removeprefix(".")
    if wanted not in FORMATS:
        got = f"'{form}'" if form else f"the file name '{out}' and no --format"
        raise ValueError(f"format: expected one of {', '.join(FORMATS)}, got {got}")
    return wanted


def _target(out: str, wanted: str) -> Path:
    """The file to write, checked before any work is done."""
    path = Path(out)
    if not out.strip() or path.is_dir():
        raise ValueError(f"out: expected a file name, got {f'the folder {out!r}' if out.strip() else repr(out)}")
    writable_folder(str(path.parent))
    return path if path.suffix.lower() == f".{wanted}" else path.with_name(f"{path.name}.{wanted}")


def _size(width: str, band: str, wanted: str) -> Size:
    from rodatlas.rods.band import Band, ratio_from_text

    if width and band:
        raise ValueError("width: expected no --width beside --band, which has one")
    if band:
        real = Band.from_text(band)
        return Size(real.aspect, real.thickness / real.length, real.length, "mm")
    if wanted == "stl":
        raise ValueError("band: expected LENGTHxWIDTHxTHICKNESS in mm for STL, which needs a thickness, got none")
    return Size(ratio_from_text(width or "1/80"))


def _samples(text: str) -> int:
    if not text.isdecimal() or not 3 <= int(text) <= 100_000:
        raise ValueError(f"samples: expected a whole number from 3 to 100000, got '{text}'")
    return int(text)


def _tables(
    found: Result | StatesTable, state: str, place: float | None, target: Path, size: Size, samples: int
) -> list[Path]:
    """Write tables: a single one into the target, several beside each other with their names added."""
    from rodatlas.atlas.contents import shapes_of, tables_of
    from rodatlas.plot.exports import with_millimeters, write_csv

    if state:
        (found,) = shapes_of(found, state, place).values()
    elif place is not None:
        raise ValueError("shear: expected --state beside --shear for a table, got none")
    frames, comments = tables_of(found, samples)
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
        shear = next(iter(shapes.values()))["dD"]
        note(f"shear {shear:g}, where most stable states coexist (--shear chooses another)")
    return shapes


def _shapes(solutions: Mapping[str, Solution], wanted: str, target: Path, size: Size, samples: int) -> list[Path]:
    """Write shapes: all into one scene of GLB, one file for each of other formats."""
    from rodatlas.plot.exports import box, point_fields, sheet, write_glb, write_stl, write_vtp
    from rodatlas.plot.style import color_of
    from rodatlas.plot.surface import band_surface

    surfaces = {name: band_surface(s, size.width, samples) for name, s in solutions.items()}
    if wanted == "glb":
        meshes = {}
        for name, surface in surfaces.items():
            digits = color_of(name or None).lstrip("#")
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
