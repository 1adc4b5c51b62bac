"""`rodatlas export`: tables and shapes of a result file for other programs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from rodatlas.cli.common import note, number, writable_folder

if TYPE_CHECKING:
    import pandas as pd

    from rodatlas.continuation import Solution

FORMATS = ("csv", "vtp", "glb", "stl")
STATES = "rodatlas/states/1"


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
    search = Path(file).suffix == ".json"
    if search and (wanted != "csv" or state or shear):
        raise ValueError(f"file: expected an HDF5 file for shapes and single states, got '{file}'")
    size, count = _size(width, band, wanted), _samples(samples)
    place = number("shear", shear) if shear else None
    if search:
        written = _tables({"": _states_frame(Path(file))}, [], target, size)
    else:
        from rodatlas.atlas.open import open_result

        found: Any = open_result(file)
        if state:
            found = _chosen(found, file, state, place)
        elif place is not None:
            _check_shear(found, file, wanted)
        if wanted == "csv":
            written = _tables(*_frames(found, file, count), target, size)
        else:
            written = _shapes(_solutions(found, file, place), wanted, target, size, count)
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


def _chosen(found: Any, file: str, state: str, place: float | None) -> Solution:
    """One state of a slice."""
    from rodatlas.atlas.slices.pick import pick_state
    from rodatlas.atlas.slices.result import Slice

    if not isinstance(found, Slice):
        raise ValueError(f"state: expected --state only with the file of a slice, got {found!r} in {file}")
    if place is None:
        raise ValueError(f"shear: expected the shear at which {state} is wanted, got none")
    return pick_state(found, state, place)


def _check_shear(found: Any, file: str, wanted: str) -> None:
    """A shear without the name of a state is for shapes of a slice."""
    from rodatlas.atlas.slices.result import Slice

    if not isinstance(found, Slice):
        raise ValueError(f"shear: expected --shear only with the file of a slice, got {found!r} in {file}")
    if wanted == "csv":
        raise ValueError("shear: expected --state beside --shear for a table, got none")


def _frames(found: Any, file: str, samples: int) -> tuple[Mapping[str, pd.DataFrame], list[str]]:
    """Tables by name and comment lines for them; the name of a single table is empty."""
    from rodatlas.atlas import Loci, Slice
    from rodatlas.continuation import Solution
    from rodatlas.plot.exports import loci_tables, slice_tables, solution_table
    from rodatlas.plot.exports.tables import UNITS

    if isinstance(found, Solution):
        frame, comments = solution_table(found, samples)
        return {"": frame}, comments
    if isinstance(found, Slice):
        settings = ", ".join(f"{key} = {value}" for key, value in found.settings.identity().items())
        return slice_tables(found), [settings, UNITS]
    if isinstance(found, Loci):
        settings = ", ".join(f"{key} = {value}" for key, value in found.settings.identity().items())
        return loci_tables(found), [settings, UNITS]
    return {"": found.to_frame()}, [f"from {file}"]


def _states_frame(path: Path) -> pd.DataFrame:
    """The table of what `rodatlas states --json` wrote."""
    import pandas as pd

    expected = f"file: expected what 'rodatlas states --json' writes (schema {STATES}), got"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{expected} '{path}' ({error.strerror})") from None
    except ValueError as error:
        raise ValueError(f"{expected} '{path}', which is not JSON ({error})") from None
    if not isinstance(data, dict) or data.get("schema") != STATES:
        raise ValueError(f"{expected} '{path}' with {data.get('schema') if isinstance(data, dict) else 'a list'!r}")
    rows = []
    for entry in data["states"]:
        row = {key: data[key] for key in ("angle_deg", "compression", "shear") if key in data}
        for key, value in entry.items():
            if isinstance(value, list):
                row |= {f"{key}_{i + 1}": x for i, x in enumerate(value)}
            elif isinstance(value, dict):
                row |= {f"{key}_{inner}": x for inner, x in value.items()}
            else:
                row[key] = value
        rows.append(row)
    return pd.DataFrame(rows)


def _tables(frames: Mapping[str, pd.DataFrame], comments: Sequence[str], target: Path, size: Size) -> list[Path]:
    """Write tables: a single one into the target, several beside each other with their names added."""
    from rodatlas.plot.exports import with_millimeters, write_csv

    written = []
    for name, frame in frames.items():
        table = with_millimeters(frame, size.length) if size.unit == "mm" else frame
        path = target.with_name(f"{target.stem}-{name}{target.suffix}") if name else target
        written.append(write_csv(path, table, comments))
    return written


def _solutions(found: Any, file: str, place: float | None) -> dict[str, Solution]:
    """The shapes to write, by name: that of a solution, or the coexisting stable states of a slice."""
    from rodatlas.atlas import Slice, coexisting_states, richest_shear
    from rodatlas.continuation import Solution

    if isinstance(found, Solution):
        if missing := {"q0", "q1", "q2", "q3", "x", "y", "z", "k1", "tau"} - set(found.unknowns):
            raise ValueError(f"file: expected the solution of a rod, got one without {', '.join(sorted(missing))}")
        return {"": found}
    if not isinstance(found, Slice):
        raise ValueError(f"file: expected a solution or a slice for shapes, got {found!r} in {file}")
    if place is None:
        place = richest_shear(found.states)
        note(f"shear {place:g}, where most stable states coexist (--shear chooses another)")
    return coexisting_states(found, place)


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
        path = _beside(target, name, written)
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
    path = target.with_name(f"{target.stem}-{name}{target.suffix}") if name else target
    if str(path).lower() in {str(p).lower() for p in taken}:
        path = path.with_name(f"{path.stem}-2{path.suffix}")
    return path
