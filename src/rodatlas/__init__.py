"""Equilibria, stability and bifurcations of clamped elastic rods and bands.

>>> import rodatlas
>>> found = rodatlas.compute_slice(rodatlas.band_slice(15.0))  # all states at a clamp angle of 15 degrees
>>> print(found.to_frame())  # the stable ones, and where each ends
>>> rodatlas.draw_slice(found)  # height against shear

The names that are needed first are here, each loaded when it is used; all of them are in the packages below:

- `rodatlas.atlas`: slices, loci and the phase diagram (`compute_slice`, `compute_loci`, `compute_phase`), whose results
  have `save`, `load` and `to_frame`; `rodatlas.atlas.study`: many of them in a folder.
- `rodatlas.states`: the search for all states at one setting (`find_states`).
- `rodatlas.plot`: figures (`draw_slice`, `draw_loci`, `draw_phase`, `render_band`); `rodatlas.plot.exports`: files.
- `rodatlas.rods`: clamps (`Ends`), bands in mm (`Band`), one state (`state_at`, `RodState`), its index (`index_of`).
- `rodatlas.paper`: the band of Yu and Hanna, its names and figures (`band_slice`, `band_loci`, `band_phase`).
- `rodatlas.model`: what all of these are given (`Model`, `Control`); `SliceSettings.of` takes any, along any control.
- `rodatlas.continuation`: the engine for two-point boundary value problems of any kind (`BVP`, `trace`, ...).

Angles are in degrees where the name ends in `_deg`, lengths in units of the length of the rod.
"""

from __future__ import annotations

from importlib import import_module as _import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodatlas.atlas import (
        Loci,
        LociSettings,
        PhaseDiagram,
        PhaseSettings,
        Slice,
        SliceSettings,
        coexisting_states,
        compute_loci,
        compute_phase,
        compute_slice,
        solve_state,
    )
    from rodatlas.continuation import (
        BVP,
        Branch,
        MeshControl,
        NotConverged,
        Solution,
        StepControl,
        Symmetry,
        TraceOptions,
        end_value,
        follow_locus,
        integral_of,
        other_solutions,
        solve,
        switch,
        switch_all,
        trace,
    )
    from rodatlas.model import Control, Model, Quantity
    from rodatlas.paper import band_loci, band_phase, band_slice
    from rodatlas.plot import band_surface, draw_loci, draw_phase, draw_profiles, draw_slice, render_band, save_figure
    from rodatlas.rods import (
        Band,
        BandUnits,
        Ends,
        RodState,
        index_of,
        limiting_shear,
        rod_problem,
        self_contact,
        state_at,
    )
    from rodatlas.states import Discovery, find_states

__version__ = "0.1.0"

_PACKAGES = ("atlas", "cli", "continuation", "model", "paper", "plot", "rods", "states")
_NAMES = {
    "atlas": (
        "Loci", "LociSettings", "PhaseDiagram", "PhaseSettings", "Slice", "SliceSettings", "coexisting_states",
        "compute_loci", "compute_phase", "compute_slice", "solve_state",
    ),
    "continuation": (
        "BVP", "Branch", "MeshControl", "NotConverged", "Solution", "StepControl", "Symmetry", "TraceOptions",
        "end_value", "follow_locus", "integral_of", "other_solutions", "solve", "switch", "switch_all", "trace",
    ),
    "model": ("Control", "Model", "Quantity"),
    "paper": ("band_loci", "band_phase", "band_slice"),
    "plot": (
        "band_surface", "draw_loci", "draw_phase", "draw_profiles", "draw_slice", "render_band", "save_figure",
    ),
    "rods": (
        "Band", "BandUnits", "Ends", "RodState", "index_of", "limiting_shear", "rod_problem", "self_contact",
        "state_at",
    ),
    "states": ("Discovery", "find_states"),
}  # fmt: skip
_HOME = {name: package for package, names in _NAMES.items() for name in names}

__all__ = [  # the names of _NAMES, written out for tools that read and do not run
    "BVP", "Band", "BandUnits", "Branch", "Control", "Discovery", "Ends", "Loci", "LociSettings", "MeshControl",
    "Model", "NotConverged", "PhaseDiagram", "PhaseSettings", "Quantity", "RodState", "Slice", "SliceSettings",
    "Solution", "StepControl", "Symmetry", "TraceOptions", "band_loci", "band_phase", "band_slice", "band_surface",
    "coexisting_states", "compute_loci", "compute_phase", "compute_slice", "draw_loci", "draw_phase", "draw_profiles",
    "draw_slice", "end_value", "find_states", "follow_locus", "index_of", "integral_of", "limiting_shear",
    "other_solutions", "render_band", "rod_problem", "save_figure", "self_contact", "solve", "solve_state",
    "state_at", "switch", "switch_all", "trace",
]  # fmt: skip

if not TYPE_CHECKING:  # else any name would pass a type checker

    def __getattr__(name: str) -> object:
        """A name of the face, or a package, loaded when it is first asked for."""
        if name in _PACKAGES:
            return _import_module(f"rodatlas.{name}")
        if name in _HOME:
            value = globals()[name] = getattr(_import_module(f"rodatlas.{_HOME[name]}"), name)
            return value
        raise AttributeError(f"module 'rodatlas' has no attribute '{name}'{_advice(name)}", name=name)


def __dir__() -> list[str]:
    return sorted({*__all__, *_PACKAGES, "__version__", "__doc__", "__name__", "__file__", "__path__"})


def _advice(name: str) -> str:
    """What may have been meant: a name of the face that is alike."""
    if name.startswith("_"):
        return ""  # asked for by tools, seldom by people
    from difflib import get_close_matches

    folded = {known.lower(): known for known in (*__all__, *_PACKAGES)}
    near = get_close_matches(name.lower(), folded, n=3, cutoff=0.6)
    return f"; did you mean {' or '.join(folded[n] for n in near)}?" if near else ""
