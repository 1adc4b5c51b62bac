"""What is found on the way depends neither on how long the steps are, nor on how fine the first mesh is.

Every example of the gallery runs again with steps and meshes of other sizes. Its `main` stays what a user reads: it
imports `TraceOptions` and the verbs from the package's face, and finds there some that scale what it asks for.
"""

from __future__ import annotations

import inspect
import runpy
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodatlas.continuation as engine
from rodatlas.continuation import Branch, Locus, Solution, StepControl, TraceOptions

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))
FACTORS = ((0.3, 1.0), (3.0, 2.0), (1.0, 0.5))  # of steps and meshes
SAME = 1e-6
TOUCHES = ("arch",)  # a mode that reaches zero and turns (the third, at q = 3 pi^4 for a rise of 3) is no branch point,
# but told as nearly singular where a step comes close enough to it


@dataclass(frozen=True)
class Place:
    """A special point of a branch, or an event of a locus: its kind and multiplicity, and its free parameters."""

    what: tuple[str, str, int]
    where: tuple[float, ...]

    def is_at(self, other: Place) -> bool:
        return self.what == other.what and np.allclose(self.where, other.where, rtol=SAME, atol=SAME)


@dataclass(frozen=True)
class Found:
    """What one example finds on one branch or locus, in order, whether everything was verified, and why it ends."""

    places: tuple[Place, ...]
    complete: bool
    ends: frozenset[str]

    def agrees(self, other: Found) -> bool:
        alike = (self.complete, self.ends, len(self.places)) == (other.complete, other.ends, len(other.places))
        return alike and any(
            all(a.is_at(b) for a, b in zip(self.places, there, strict=True))
            for there in (other.places, other.places[::-1])
        )


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "mesh"), FACTORS)
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_same_points(path: Path, steps: float, mesh: float) -> None:
    """The two sides of a branch point may come in the other order: which kernel vector is called positive is open."""
    expected, missing = list(findings(path, steps, mesh)), []
    for one in findings(path, 1.0, 1.0):
        if path.stem in TOUCHES:
            one, expected = replace(one, complete=True), [replace(other, complete=True) for other in expected]
        same = next((other for other in expected if one.agrees(other)), None)
        if same is None:
            missing.append(one)
        else:
            expected.remove(same)
    assert (missing, expected) == ([], [])


@lru_cache
def findings(path: Path, steps: float, mesh: float) -> tuple[Found, ...]:
    """Run an example with its steps and meshes scaled."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "TraceOptions", lambda **given: scaled(TraceOptions(**given), steps, mesh))
        for name in ("solve", "trace", "switch", "switch_all", "follow_locus"):
            patch.setattr(engine, name, scaling(getattr(engine, name), steps, mesh))
        found = tuple(read(one) for one in flat(runpy.run_path(str(path))["main"]()))
    assert found
    return found


def scaled(options: TraceOptions, steps: float, mesh: float) -> TraceOptions:
    """Options with all steps `steps` times as long, and limits of the mesh `mesh` times as high."""
    fewest, most = options.mesh.intervals
    return replace(
        options, step=longer(options.step, steps), max_points=round(options.max_points / min(steps, 1.0)),
        mesh=replace(options.mesh, intervals=(round(mesh * fewest), round(mesh * most))),
    )  # fmt: skip


def longer(step: StepControl, factor: float) -> StepControl:
    """Steps are chosen by their first correction, which grows with their third power."""
    return replace(step, initial=factor * step.initial, maximum=factor * step.maximum, target=factor**3 * step.target)


def finer(start: Solution, factor: float) -> Solution:
    """The same start on `factor` times as many intervals, spaced alike."""
    old = np.linspace(0, 1, start.intervals + 1)
    return start.remesh(np.interp(np.linspace(0, 1, round(factor * start.intervals) + 1), old, start.mesh))


def scaling(verb: Callable[..., Any], steps: float, mesh: float) -> Callable[..., Any]:
    """A verb that starts on another mesh, and that scales the default options where none are given."""

    @wraps(verb)
    def call(*args: Any, **kwargs: Any) -> Any:
        given = inspect.signature(verb).bind(*args, **kwargs).arguments
        given["options"] = given.get("options") or scaled(TraceOptions(), steps, mesh)
        for name in ("start", "guess"):
            if isinstance(given.get(name), Solution):
                given[name] = finer(given[name], mesh)
        return verb(**given)

    return call


def flat(found: object) -> Iterator[Branch | Locus]:
    """The branches and loci in what an example returns."""
    if isinstance(found, (Branch, Locus)):
        yield found
    elif isinstance(found, (tuple, list, Mapping)):
        for one in found.values() if isinstance(found, Mapping) else found:
            yield from flat(one)


def read(found: Branch | Locus) -> Found:
    points = found.special if isinstance(found, Branch) else found.events
    places = tuple(
        Place((x.kind, getattr(x, "parameter", ""), getattr(x, "multiplicity", 1)),
              tuple(x.solution[name] for name in found.free))
        for x in points
    )  # fmt: skip
    complete = isinstance(found, Locus) or (found.verification is not None and found.verification.complete)
    return Found(places, complete, frozenset(reason.name for reason in found.ends))
