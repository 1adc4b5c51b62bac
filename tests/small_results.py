"""Results that take no time, for tests of what is done with results: the computation at the bottom is replaced."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import rodatlas
from rodatlas.atlas import (
    Loci,
    LociSettings,
    PhaseDiagram,
    PhaseSettings,
    Slice,
    SliceSettings,
    compute_loci,
    compute_slice,
)
from rodatlas.atlas.phase.arrangement import chords, cut_plane
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.regions import Face
from rodatlas.paper.model import band_loci
from rodatlas.plot import draw_slice
from rodatlas.rods import Ends
from rodatlas.states import Discovery, find_states

STARTS = 64
KEPT = ("U", "U.1", "M3")  # branches of a thin slice: U with uUu, the pair US+-, and the third mode with w

PLACES = {  # modules that have a function by its name
    "compute_slice": ("rodatlas.atlas", "rodatlas.atlas.slices.obtain"),
    "compute_loci": ("rodatlas.atlas", "rodatlas.atlas.loci.obtain", "rodatlas.atlas.phase.obtain"),
    "compute_phase": ("rodatlas.atlas", "rodatlas.atlas.phase.obtain"),
    "find_states": ("rodatlas.states", "rodatlas.states.discover", "rodatlas.atlas.study.kinds.states"),
    "draw_slice_figure": ("rodatlas.plot",),
    "LocalExecutor": ("rodatlas.atlas.study.run", "rodatlas.atlas.study.many"),
}


class Threads(ThreadPoolExecutor):
    """A thread in place of worker processes, which would know nothing of what is replaced here."""

    def __init__(self, workers: int):
        super().__init__(1)


def thin(found: Slice) -> Slice:
    """A few branches of a slice."""
    branches = tuple(b for b in found.branches if b.id in KEPT)
    return replace(found, branches=branches, states=tuple(s for s in found.states if s.branch in KEPT))


def plain_figure(found: Slice, *_: Any) -> Figure:
    """The diagram of a slice without drawings of bands, whose placement takes seconds."""
    return draw_slice(found).figure


def straight_phase(settings: PhaseSettings) -> PhaseDiagram:
    """Loci 4 and 11 as straight lines: U below, the pair US+- between, and uUu beside it above."""
    angle = np.linspace(settings.second_low, settings.second_high, 30)
    lines = tuple(
        Line(label, "pitchfork", np.column_stack([angle, np.full(30, shear)])) for label, shear in
        (("4", 0.33), ("11", 0.61))
    )  # fmt: skip
    faces, middle = [], float(angle.mean())
    for rings in cut_plane(lines, settings):
        ((low, high),) = chords(rings, middle)
        shear = 0.5 * (low + high)
        states = ("U",) if shear < 0.33 else ("US+-",) if shear < 0.61 else ("US+-", "uUu")
        faces.append(Face(rings, states, ((middle, shear),)))
    return PhaseDiagram(settings, lines, tuple(faces), (), (), (15.0,))


def replace_computations(patch: pytest.MonkeyPatch, whole: Slice, loci: Callable[[], Loci]) -> None:
    """Let everything that computes give a small result at once, labeled with the settings that were wanted.

    Parameters
    ----------
    whole : a slice, of which a thin part is given.
    loci : gives loci.
    """

    def slice_of(settings: SliceSettings, cache: Any = None, progress: Any = None, *_: Any, **__: Any) -> Slice:
        if settings.model is whole.settings.model and settings.along == whole.settings.along:
            return replace(thin(whole), settings=settings)
        if settings.model.ribbon is None:
            return compute_slice(settings, None, progress, carry=False)
        few = 0.05 * (settings.high - settings.low)  # of rods a short range, and not the longer one behind it
        near = {"low": max(settings.low, settings.anchor - few), "high": min(settings.high, settings.anchor + few)}
        short = replace(settings, **near, search=0, tolerance=1e-6)
        with pytest.MonkeyPatch.context() as alone:
            alone.setattr("rodatlas.atlas.slices.branches.follow._whole", lambda settings: None)
            found = compute_slice(short, None, progress, carry=False)  # takes some seconds
        return replace(found, settings=settings)

    def loci_of(
        settings: LociSettings, slice_at: Callable[..., Slice], numbers: Sequence[int] = (), *_: Any, **__: Any
    ) -> Loci:
        if settings.model is not whole.settings.model:
            return compute_loci(settings, slice_at, numbers)
        slice_at(15.0)
        return replace(loci(), settings=settings, wanted=tuple(numbers) or loci().wanted)

    def phase_of(settings: PhaseSettings, *_: Any, **__: Any) -> PhaseDiagram:
        return straight_phase(settings)

    def states_of(
        ends: Ends, poisson: float = 0.25, classes: str = "both", starts: int | None = None, **rest: Any
    ) -> Discovery:
        return find_states(ends, poisson, classes, min(starts or STARTS, STARTS), **rest)

    new = {"compute_slice": slice_of, "compute_loci": loci_of, "compute_phase": phase_of, "find_states": states_of,
           "draw_slice_figure": plain_figure, "LocalExecutor": Threads}  # fmt: skip
    for name, places in PLACES.items():
        face = ("rodatlas",) if name in rodatlas.__all__ else ()
        for place in (*face, *places):  # the face first: it remembers what its package has
            patch.setattr(import_module(place), name, new[name])


def few_loci(whole: Slice) -> Loci:
    """Loci of the pitchforks 4 and 11, and of fold 12, which is born on the first."""
    branches = tuple(b for b in whole.branches if b.id in KEPT[:2])
    return compute_loci(band_loci(), lambda angle: replace(whole, branches=branches), (4, 11, 12))
