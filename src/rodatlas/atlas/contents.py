"""What is in a result, for other programs: tables, and shapes by name."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodatlas.atlas.results import Result, Tables, kind_of
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.states.coexisting import coexisting_states, richest_value
from rodatlas.atlas.slices.states.pick import pick_state
from rodatlas.continuation import Solution
from rodatlas.rods.ends import Ends
from rodatlas.rods.state import FORMULATIONS
from rodatlas.states.discover import Discovery
from rodatlas.states.labels import labels
from rodatlas.states.rebuild import rebuilt
from rodatlas.states.result import SCHEMA

SETTING = ("compression", "shear", "offset", "twist", "poisson")  # and the angle, or both angles
NUMBERS: dict[str, tuple[int, ...]] = {"N0": (3,), "M0": (3,), "energy": ()}  # of each state, and how many
MOST = 1e9  # size of any of them: a slip of the pen


@dataclass(frozen=True)
class StatesTable:
    """What `rodatlas states --json` wrote: the object with its list of states."""

    data: Mapping[str, Any]

    def __repr__(self) -> str:
        setting = ", ".join(f"{name} {value:g}" for name, value in self.data["setting"].items())
        return f"StatesTable({len(self.data['states'])} states at {setting})"


def read_states_table(path: str | os.PathLike[str]) -> StatesTable:
    """Read what `rodatlas states --json` wrote.

    Raises
    ------
    ValueError
        one line, when the file is missing, or no JSON, or holds something else.
    """
    expected = f"file: expected what 'rodatlas states --json' writes (schema {SCHEMA}), got"
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{expected} '{path}' ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{expected} '{path}', which is not JSON ({error})") from None
    found = data.get("schema") if isinstance(data, dict) else type(data).__name__
    if found != SCHEMA or not isinstance(data.get("states"), list):
        raise ValueError(f"{expected} '{path}' with {found!r}")
    for i, entry in enumerate(data["states"], 1):
        _check_entry(entry, f"{path}: state {i}")
    setting = data.get("setting")
    if not isinstance(setting, dict):
        raise ValueError(f"{path}: setting: expected an object with {', '.join(SETTING)}, got {setting!r}"[:200])
    angles = ("angle_left", "angle_right") if "angle_left" in setting else ("angle",)
    for name in (*angles, *SETTING):
        _check_numbers(setting.get(name), (), f"{path}: setting, {name}")
    try:
        _ends_of(setting)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return StatesTable(data)


def _ends_of(setting: Mapping[str, Any]) -> Ends:
    return Ends.from_setting({name: value for name, value in setting.items() if name != "poisson"})


def _check_entry(entry: Any, place: str) -> None:
    """ValueError for a state that lacks what tables and shapes need, or has it in another form."""
    if not isinstance(entry, dict):
        raise ValueError(f"{place}: expected an object, got {type(entry).__name__}")
    for name, shape in NUMBERS.items():
        _check_numbers(entry.get(name), shape, f"{place}, {name}")
    for name in ("name", "class"):
        if not isinstance(entry.get(name), str | None):
            raise ValueError(f"{place}, {name}: expected a text, got {entry[name]!r}")
    if not isinstance(entry.get("inflections", {}), dict):
        raise ValueError(f"{place}, inflections: expected an object, got {entry['inflections']!r}")


def _check_numbers(value: Any, shape: tuple[int, ...], place: str) -> None:
    """ValueError for what is no finite number, or no list of so many."""
    values = value if shape and isinstance(value, list) else [value]
    fits = not shape or (isinstance(value, list) and len(value) == shape[0])
    right = (isinstance(x, int | float) and not isinstance(x, bool) and abs(x) < MOST for x in values)
    if not (fits and all(right)):
        what = f"a list of {shape[0]} numbers" if shape else "a finite number"
        got = "none" if value is None else f"{value!r}"[:80]
        raise ValueError(f"{place}: expected {what}, got {got}")


def tables_of(result: Result | StatesTable, samples: int) -> Tables:
    """Tables by name, '' for a single one, and comment lines for them.

    Parameters
    ----------
    samples : rows of the table of a solution.
    """
    if isinstance(result, StatesTable):
        from rodatlas.plot.exports.tables import UNITS, states_table

        return {"": states_table(result.data)}, [UNITS]
    return kind_of(result).tables(result, samples)


def shapes_of(result: Result | StatesTable, state: str = "", place: float | None = None) -> dict[str, Solution]:
    """Shapes of rods by name, '' for that of a solution.

    Parameters
    ----------
    state : name of one of the states; all when empty.
    place : of a slice, the value of what varies at which its states are wanted; by default one at which the most
        coexist.

    Raises
    ------
    ValueError
        when there is no such state or shape.
    """
    if isinstance(result, Slice):
        along, model = result.settings.along, result.settings.model
        if model.ribbon is None:
            raise ValueError(f"file: expected states that have a shape, got those of the model {model.name}")
        if state:
            if place is None:
                raise ValueError(f"{along}: expected the {along} at which {state} is wanted, got none")
            return {state: pick_state(result, state, place)}
        return coexisting_states(result, richest_value(result.states) if place is None else place)
    if place is not None:
        raise ValueError(f"at: expected a value only for the states of a slice, got {place:g} with {result!r}")
    if isinstance(result, Discovery | StatesTable):
        return _of_states(result, state)
    if state:
        raise ValueError(f"state: expected a name only for a slice or a search for states, got '{state}'")
    if not isinstance(result, Solution):
        raise ValueError(f"file: expected a solution, a slice or found states for shapes, got {result!r}")
    if all(missing := [formulation.missing(result) for formulation in FORMULATIONS]):
        raise ValueError(f"file: expected the solution of a rod, got one without {', '.join(missing[0])}")
    return {"": result}


def _of_states(result: Discovery | StatesTable, wanted: str) -> dict[str, Solution]:
    """States of a search by label; those without a name are called by their class and place in the table: '+5'."""
    data: Mapping[str, Any] = result.to_json() if isinstance(result, Discovery) else result.data
    entries = data["states"]
    try:
        measures = [(float(x["energy"]), -float(x["N0"][0])) for x in entries]
    except (KeyError, TypeError, IndexError, ValueError):
        raise ValueError("file: expected energy and N0 of each state, got none of one") from None
    called = labels([x.get("name") for x in entries], *([m[k] for m in measures] for k in (0, 1)))
    found = {label or f"{entries[i].get('class', '')}{i + 1}": i for i, label in enumerate(called)}
    if wanted and wanted not in found:
        raise ValueError(f"state: expected one of {', '.join(found)}, got '{wanted}'")
    kept = {name: at for name, at in found.items() if not wanted or name == wanted}
    if isinstance(result, Discovery):
        return {name: result.states[at].solution for name, at in kept.items()}
    return {name: _rebuilt(data, data["states"][at]) for name, at in kept.items()}


def _rebuilt(data: Mapping[str, Any], entry: Mapping[str, Any]) -> Solution:
    setting = data["setting"]
    return rebuilt(_ends_of(setting), entry["N0"], entry["M0"], float(entry["energy"]), setting["poisson"])
