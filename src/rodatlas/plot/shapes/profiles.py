"""Profiles along the band of the states that coexist at one setting: curvature, twist, tension, energy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.plot.look.heading import ARCLENGTH_LABEL, CURVATURE_LABEL, TWIST_LABEL, setting_of
from rodatlas.plot.look.style import (
    FAINT,
    TWO_COLUMN,
    base_name,
    color_of,
    colors_in_order,
    label_of,
    new_figure,
    styled,
)
from rodatlas.plot.slices.overlaps import draw_coinciding
from rodatlas.rods.band import NARROW
from rodatlas.rods.contact import self_contact
from rodatlas.rods.law import LinearLaw
from rodatlas.rods.model import CONTROLS
from rodatlas.rods.state import RodState

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rodatlas.continuation import Solution
    from rodatlas.model import Control

SAMPLES = 601
HEIGHT = 4.5
NOTE_SIZE = 7.0
LEAST_SPAN = 1e-3  # of an axis: a planar band has no twist, and round-off is not shown as one


PANELS: tuple[tuple[str, Callable[[RodState], np.ndarray]], ...] = (
    (CURVATURE_LABEL, lambda state: state.k1),
    (TWIST_LABEL, lambda state: state.tau),
    (r"tension $N_3$  ($GJ/L^2$)", lambda state: state.tension),
    (r"energy density $a\kappa_1^2+\tau^2$  ($GJ/L^2$)", lambda state: 2 * state.energy_density),  # as in the paper
)
ANY_ENERGY = r"energy density $2W$  ($GJ/L^2$)"  # of another law than that of the band


def draw_profiles(
    states: Mapping[str, Solution | RodState], colors: Mapping[str, str] | None = None,
    controls: Sequence[Control] = CONTROLS,
) -> Figure:  # fmt: skip
    """Draw curvature, twist, tension and energy density over the arclength, one color for each state.

    Parameters
    ----------
    states : name -> solution, or one read as a rod where its law is not of the package, all at one setting; a member
        of a +/- pair is named 'A2+', and stands for both unless the other one is there too, which is then dashed.
    colors : by name, such as :func:`rodatlas.plot.colors_of` gives for a slice; distinct ones by default.
    controls : of the model, for the heading; those of a band by default.

    Returns
    -------
    a figure as wide as a page.
    """
    check_type("states", states, Mapping, "a mapping of names to Solutions")
    if not states:
        raise ValueError("states: expected at least one solution, got none")
    s = np.linspace(0.0, 1.0, SAMPLES)
    colors = colors_in_order(states) if colors is None else colors
    rods = {name: x if isinstance(x, RodState) else RodState(x) for name, x in states.items()}
    sampled = {name: rod.at(s) for name, rod in rods.items()}
    with styled():
        fig = new_figure(TWO_COLUMN, HEIGHT)
        panels = fig.subplots(2, 2, sharex=True)
        fig.subplots_adjust(left=0.077, right=0.988, bottom=0.118, top=0.905, wspace=0.2, hspace=0.1)
        band = all(isinstance(rod.law, LinearLaw) and rod.law.rigid[1] for rod in rods.values())
        titles = [title for title, _ in PANELS] if band else [*(title for title, _ in PANELS[:-1]), ANY_ENERGY]
        for letter, ax, title, (_, field) in zip("abcd", panels.ravel(), titles, PANELS, strict=True):
            _draw_panel({name: field(x) for name, x in sampled.items()}, colors, s, letter, title, ax)
        for ax in panels[1]:
            ax.set_xlabel(ARCLENGTH_LABEL)
        fig.align_ylabels(panels[:, 0])
        fig.align_ylabels(panels[:, 1])
        _draw_heading({name: rod.solution for name, rod in rods.items()}, controls, fig)
        fig.draw_without_rendering()
    return fig


def _draw_panel(
    curves: Mapping[str, np.ndarray], colors: Mapping[str, str], s: np.ndarray, letter: str, title: str, ax: Axes
) -> None:
    """One field of all states over the arclength."""
    ax.axhline(0.0, color=FAINT, lw=0.5, zorder=0.5)
    solid = []
    for name, values in curves.items():
        mirrored = name.endswith("-") and f"{name[:-1]}+" in curves
        style: dict[str, Any] = {"lw": 1.0, "ls": (0, (3.0, 1.2))} if mirrored else {"lw": 1.3, "ls": "-"}
        (line,) = ax.plot(s, values, color=color_of(name, colors), label=label_of(name), gid=name, **style)
        solid += [] if mirrored else [line]
    ax.set_xlim(0.0, 1.0)
    low = min(float(v.min()) for v in curves.values())
    high = max(float(v.max()) for v in curves.values())
    missing = max(LEAST_SPAN - (high - low), 0.0)
    low, high = low - 0.5 * missing, high + 0.5 * missing
    ax.set_ylim(low - 0.06 * (high - low), high + 0.16 * (high - low))
    draw_coinciding(solid, ax)
    ax.set_ylabel(title)
    ax.text(0.018, 0.965, f"({letter})", transform=ax.transAxes, va="top", ha="left")


def _draw_heading(states: Mapping[str, Solution], controls: Sequence[Control], fig: Figure) -> None:
    """The setting and the names of the states above the panels; what a pair's member stands for below them."""
    setting = setting_of(next(iter(states.values())), controls=controls)
    fig.text(0.077, 0.958, setting, va="center", ha="left", fontsize=9.0)
    handles, labels = fig.axes[0].get_legend_handles_labels()
    fig.legend(
        handles, labels, loc="center right", bbox_to_anchor=(0.996, 0.958), ncols=len(labels), handlelength=1.6,
        columnspacing=1.4, handletextpad=0.5, borderaxespad=0.0, fontsize=9.0,
    )  # fmt: skip
    touching = [label_of(name) for name, state in states.items() if self_contact(state)]
    if touching:
        note = f"{', '.join(touching)}: a band $L/{1 / NARROW:.0f}$ wide touches itself."
        fig.text(0.077, 0.012, note, ha="left", va="bottom", fontsize=NOTE_SIZE)
    members = [n for n in states if base_name(n).endswith("+-") and {n[:-1] + "+", n[:-1] + "-"} - states.keys()]
    if members:
        others = [label_of(n[:-1] + ("-" if n[-1] == "+" else "+")) for n in members]
        pairs = f"{' and '.join(others)} {'is the reversal' if len(others) == 1 else 'are the reversals'}"
        fig.text(0.988, 0.012, rf"{pairs} $s \to 1-s$, not drawn.", ha="right", va="bottom", fontsize=NOTE_SIZE)
