"""Every kind of result that has a file of its own, in one table: what it is called, how it is read, what is in it.

A new kind is an entry of `RESULTS`: files of it are then opened, listed and written as tables. What is computed by
studies has an entry in :data:`rodatlas.atlas.study.kinds.KINDS` besides, which refers to this one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas.atlas.loci.result import Loci
from rodatlas.atlas.loci.store import SCHEMA as LOCI_SCHEMA
from rodatlas.atlas.phase.result import PhaseDiagram
from rodatlas.atlas.phase.store import SCHEMA as PHASE_SCHEMA
from rodatlas.atlas.slices.result import Slice
from rodatlas.atlas.slices.store import SCHEMA as SLICE_SCHEMA
from rodatlas.continuation import Branch, Locus, Solution
from rodatlas.continuation.checks import shown
from rodatlas.continuation.store.branch import SCHEMA as BRANCH_SCHEMA
from rodatlas.continuation.store.locus import SCHEMA as LOCUS_SCHEMA
from rodatlas.continuation.store.solutions import SCHEMA as SOLUTION_SCHEMA
from rodatlas.states.discover import Discovery
from rodatlas.states.store import SCHEMA as STATES_SCHEMA
from rodatlas.states.store import load_discovery

if TYPE_CHECKING:
    import h5py
    import pandas as pd

Result = Solution | Branch | Locus | Slice | Loci | Discovery | PhaseDiagram
Tables = tuple[dict[str, "pd.DataFrame"], list[str]]
"""Tables by name, '' for a single one, and comment lines for them."""


@dataclass(frozen=True)
class ResultKind:
    """A kind of result.

    Attributes
    ----------
    word : what it is called: 'slice', say.
    schema : that of its files.
    type : its class.
    load : reads a file; ValueError when it is damaged.
    contents : what is in an open file, in a few words.
    tables : of a result; the second argument is the number of rows where it is sampled.
    parts : what an unfinished one consists of.
    """

    word: str
    schema: str
    type: type
    load: Callable[[Path], Any]
    contents: Callable[[h5py.File], str]
    tables: Callable[[Any, int], Tables]
    parts: str = "parts"


def _nothing(file: h5py.File) -> str:
    return ""


def _points(file: h5py.File) -> str:
    return f"{len(file['points/solutions/offsets']) - 1} points"


def _slice_contents(file: h5py.File) -> str:
    states, branches = (len(file[name]) if name in file else 0 for name in ("states", "branches"))
    return f"{states} states, {branches} branches"


def _loci_contents(file: h5py.File) -> str:
    return f"{len(file['curves']) if 'curves' in file else 0} curves"


def _phase_contents(file: h5py.File) -> str:
    return f"{len(file['lines'])} lines, {len(file['faces'])} faces"


def _states_contents(file: h5py.File) -> str:
    return f"{file.attrs['count']} states, {file.attrs['stable']} stable"


def _solution_tables(solution: Solution, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import solution_table

    frame, comments = solution_table(solution, samples)
    return {"": frame}, comments


def _curve_tables(curve: Branch | Locus, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import UNITS

    return {"": curve.to_frame()}, [UNITS]


def _slice_tables(found: Slice, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import slice_tables

    return slice_tables(found), _told(found)


def _loci_tables(found: Loci, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import loci_tables

    return loci_tables(found), _told(found)


def _phase_tables(found: PhaseDiagram, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import phase_tables

    return phase_tables(found), _told(found)


def _states_tables(found: Discovery, samples: int) -> Tables:
    from rodatlas.plot.exports.tables import UNITS, states_table

    return {"": states_table(found.to_json())}, [UNITS]


def _told(found: Slice | Loci | PhaseDiagram) -> list[str]:
    """Comment lines: the settings, the units."""
    from rodatlas.plot.exports.tables import UNITS

    return [", ".join(f"{key} = {value}" for key, value in found.settings.identity().items()), UNITS]


SOLUTION = ResultKind("solution", SOLUTION_SCHEMA, Solution, Solution.load, _nothing, _solution_tables)
BRANCH = ResultKind("branch", BRANCH_SCHEMA, Branch, Branch.load, _points, _curve_tables)
LOCUS = ResultKind("locus", LOCUS_SCHEMA, Locus, Locus.load, _points, _curve_tables)
SLICE = ResultKind("slice", SLICE_SCHEMA, Slice, Slice.load, _slice_contents, _slice_tables, "branches")
LOCI = ResultKind("loci", LOCI_SCHEMA, Loci, Loci.load, _loci_contents, _loci_tables, "loci")
STATES = ResultKind("states", STATES_SCHEMA, Discovery, load_discovery, _states_contents, _states_tables)
PHASE = ResultKind("phase", PHASE_SCHEMA, PhaseDiagram, PhaseDiagram.load, _phase_contents, _phase_tables)
RESULTS = (SOLUTION, BRANCH, LOCUS, SLICE, LOCI, STATES, PHASE)


def with_schema(schema: str) -> ResultKind | None:
    """The kind of result whose files have a schema; None where there is none."""
    return next((kind for kind in RESULTS if kind.schema == schema), None)


def kind_of(result: Result) -> ResultKind:
    """The kind of a result.

    Raises
    ------
    ValueError
        for what is no result of a kind in the table.
    """
    found = next((kind for kind in RESULTS if isinstance(result, kind.type)), None)
    if found is None:
        known = ", ".join(kind.type.__name__ for kind in RESULTS)
        raise ValueError(f"result: expected one of {known}, got {shown(result)}")
    return found
