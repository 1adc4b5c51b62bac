"""Results as tables of numbers, written as CSV with comment lines that tell the units."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import check_has
from rodatlas.files import replace_file
from rodatlas.rods.model import CONTROLS

if TYPE_CHECKING:
    import pandas as pd

    from rodatlas.continuation import Solution

SAMPLES = 201
UNITS = "lengths in L, forces in GJ/L^2, moments and energies in GJ/L"
MEANT = "; angles in radians, a is EI1/GJ"


def solution_table(solution: Solution, samples: int = SAMPLES) -> tuple[pd.DataFrame, list[str]]:
    """Unknowns at equidistant s, and comment lines with the parameters and observables."""
    check_has("solution", solution, ("parameter_names", "observables"), "a Solution such as state_at(Ends(15.0))")
    import pandas as pd

    s = np.linspace(0.0, 1.0, samples)
    named = [*zip(solution.parameter_names, solution.parameters.tolist(), strict=True), *solution.observables.items()]
    lines = [*(f"{key} = {value:.12g}" for key, value in named), f"{UNITS}; body components{MEANT}"]
    return pd.DataFrame(np.column_stack([s, solution(s)]), columns=["s", *solution.unknowns]), lines


def slice_tables(slice_: Any) -> dict[str, pd.DataFrame]:
    """The tables of a :class:`rodatlas.atlas.Slice`: named stable 'states', 'events' (bifurcations), and 'branches'
    with a row for each computed point, in order along each branch. The ranges of self-contact are one text."""
    check_has("slice", slice_, ("settings", "branches", "states"), "a Slice, see compute_slice and Slice.load")
    import pandas as pd

    control, controls = slice_.settings.control, slice_.settings.model.controls
    fixed = {c.parameter for c in controls} - {control.parameter}
    frames = []
    for b in slice_.branches:
        frame = pd.DataFrame(b.followed.branch.to_frame())
        if control.parameter in frame:
            frame[control.parameter] = [control.value(row) for row in frame.to_dict("records")]
        frame.insert(0, "branch", b.id)
        frames.append(frame.rename(columns={control.parameter: control.key}).drop(columns=list(fixed), errors="ignore"))
    branches = pd.concat(frames, ignore_index=True) if frames else pd.DataFrame()
    events = slice_.to_frame("events")
    if len(events):
        for side, column in enumerate(("index_before", "index_after")):
            events.insert(events.columns.get_loc("index"), column, [pair[side] for pair in events["index"]])
        events = events.drop(columns="index")
    states = slice_.to_frame()
    if len(states):
        states["contact"] = ["; ".join(f"{low:.6g} {high:.6g}" for low, high in spans) for spans in states["contact"]]
    return {"states": states, "events": events, "branches": branches}


def loci_tables(loci: Any) -> dict[str, pd.DataFrame]:
    """The tables of :class:`rodatlas.atlas.Loci`: 'events' (special points), and 'points' with a row for each computed
    point of each piece, the pieces without a number too."""
    check_has("loci", loci, ("settings", "pieces"), "Loci, see compute_loci and Loci.load")
    import pandas as pd

    settings = loci.settings
    names = (settings.second_control.key, settings.along_control.key, settings.against)
    rows = [
        {"piece": i, "number": p.number, "kind": p.kind, **dict(zip(names, place, strict=True)),
         **{name: value for name, value in x.observables.items() if name not in names}, "error": x.error}
        for i, p in enumerate(loci.pieces) for x, place in zip(p.points, p.places.tolist(), strict=True)
    ]  # fmt: skip
    points, events = pd.DataFrame(rows), loci.to_frame()
    if len(events):
        events["with"] = [" ".join(map(str, numbers)) for numbers in events["with"]]
    if rows:
        points["number"] = points["number"].astype("Int64")  # keeps whole numbers beside missing ones
    return {"events": events, "points": points}


def phase_tables(diagram: Any) -> dict[str, pd.DataFrame]:
    """The tables of a :class:`rodatlas.atlas.PhaseDiagram`: 'events' (special points), 'faces' (parts of the plane
    between loci), and 'regions' in which a state is stable, with their ranges of both controls. Polygons are left out.
    """
    check_has("diagram", diagram, ("settings", "faces", "state_regions"), "a PhaseDiagram, see PhaseDiagram.load")
    import pandas as pd

    events, faces, regions = (pd.DataFrame(diagram.to_frame(of)) for of in ("events", "faces", "regions"))
    if len(events):
        events["loci"] = [" ".join(labels) for labels in events["loci"]]
    if len(faces):
        faces["states"] = [" ".join(names or ()) for names in faces["states"]]
        faces["samples"] = ["; ".join(f"{x:.6g} {y:.6g}" for x, y in places) for places in faces["samples"]]
        for name in ("count", "names"):
            faces[name] = faces[name].astype("Int64")  # keeps whole numbers beside missing ones
    if len(regions):
        for key in (diagram.settings.second_control.key, diagram.settings.along_control.key):
            at = int(regions.columns.get_loc(key))
            ends = regions.pop(key)
            for i, side in enumerate(("low", "high")):
                regions.insert(at + i, f"{key}_{side}", [pair[i] for pair in ends])
        regions["bounds"] = [" ".join(labels) for labels in regions["bounds"]]
    return {"events": events, "faces": faces, "regions": regions}


DEGREES = {name: f"{name}_deg" for name in ("angle", "angle_left", "angle_right", "twist")}  # columns of a setting


def states_table(data: Mapping[str, Any]) -> pd.DataFrame:
    """A row for each state of the object that `rodatlas states --json` prints: the setting, then the state's fields,
    N0_1 .. M0_3, inflections_k1 .."""
    import pandas as pd

    rows = []
    for entry in data["states"]:
        row = {DEGREES.get(key, key): value for key, value in data["setting"].items()}
        for key, value in entry.items():
            if isinstance(value, list):
                row |= {f"{key}_{i}": x for i, x in enumerate(value, 1)}
            elif isinstance(value, dict):
                row |= {f"{key}_{inner}": x for inner, x in value.items()}
            else:
                row[key] = value
        rows.append(row)
    return pd.DataFrame(rows)


def _lengths() -> list[str]:
    """Columns that hold lengths of a band: places, and what its controls and quantities of that unit are called."""
    lengths = [c for c in CONTROLS if c.of == "L"]
    told = [*(c.name for c in lengths), *(c.parameter for c in lengths), "height"]
    return ["s", "x", "y", "z", *told, *(f"{name}_{side}" for name in told for side in ("low", "high"))]


def with_millimeters(frame: pd.DataFrame, length: float) -> pd.DataFrame:
    """The table with a column in mm beside each length, for a band of a length in mm."""
    check_has("frame", frame, ("columns", "insert"), "a data frame")
    out = frame.copy()
    for name in (name for name in _lengths() if name in frame):
        out.insert(int(out.columns.get_loc(name)) + 1, f"{name}_mm", length * frame[name])
    return out


def write_csv(
    path: str | os.PathLike[str], frame: pd.DataFrame, comments: Sequence[str] = (), *, bare: bool = False
) -> Path:
    """Write a table: comment lines that start with #, the names of the columns, the rows with 12 digits.

    Parameters
    ----------
    bare : let the line of names be a comment too, so that `numpy.loadtxt` reads the file as it is.
    """
    check_has("frame", frame, ("to_csv",), "a data frame")
    text = "".join(f"# {line}\n" for line in comments) + ("# " if bare else "")
    return replace_file(path, (text + frame.to_csv(index=False, float_format="%.12g")).encode())
