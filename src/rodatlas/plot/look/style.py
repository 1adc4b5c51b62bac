"""One look for all figures: colors of states, type, line widths, sizes, and how figures are saved."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from itertools import cycle
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas.continuation.checks import check_has, check_type, shown
from rodatlas.model.nomenclature import PALETTE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rodatlas.plot.look.protocols import SliceLike

UNNAMED = "#4A4A4A"
INK, UNSTABLE, FAINT = "#1A1A1A", "#6E6E6E", "#DADADA"
STABLE_WIDTH, UNSTABLE_WIDTH = 1.7, 0.65
UNSTABLE_DASHES = (4.5, 2.2)
# a stable state whose band touches itself: dots in its color, of the width of a stable line
TOUCHING: dict[str, Any] = {"ls": (0, (0.01, 1.75)), "dash_capstyle": "round", "lw": STABLE_WIDTH}
# Disks of special points. A branch point is the smaller one, so that both are seen where they nearly coincide.
MARKER_SIZE = 4.8
MARKERS: dict[str, dict[str, Any]] = {
    "fold": {"ls": "none", "marker": "o", "ms": MARKER_SIZE, "mfc": "white", "mec": INK, "mew": 0.8},
    "branch point": {"ls": "none", "marker": "o", "ms": MARKER_SIZE - 0.8, "mfc": INK, "mec": INK, "mew": 0.4},
}

# widths of a figure on one and on two columns of a journal page, in inches
ONE_COLUMN, TWO_COLUMN = 3.4, 7.0

FONT = "STIXGeneral"
RC: Any = {
    "font.family": [FONT],
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 3.0,
    "ytick.major.size": 3.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.solid_capstyle": "round",
    "lines.dash_capstyle": "butt",
    "axes.unicode_minus": True,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "pdf.fonttype": 42,
    "pdf.compression": 6,
    "path.simplify": False,
}


def base_name(name: str) -> str:
    """The name that one of several states has: 'A2+-' for 'A2+' or 'A2-', 'W' for 'W:2'; other names unchanged."""
    name = name.partition(":")[0]
    return name[:-1] + "+-" if name.endswith(("+", "-")) and not name.endswith("+-") else name


def color_of(name: str | None, colors: Mapping[str, str]) -> str:
    """Color of a state, of a member of a pair, or of one of several of one name; gray for one that has none.

    Parameters
    ----------
    colors : of the names, see :func:`colors_of` and :func:`colors_in_order`.
    """
    check_type("name", name, (str, type(None)), "the name of a state")
    check_type("colors", colors, Mapping, "a mapping of names to colors, see colors_of")
    return colors.get(base_name(name), UNNAMED) if name else UNNAMED


def colors_of(slice_: SliceLike) -> Mapping[str, str]:
    """Colors of the states of a slice by name: those of the nomenclature of its model where that names them."""
    check_has("slice", slice_, ("settings", "branches", "states"), "a Slice, see compute_slice and Slice.load")
    known = slice_.settings.model.nomenclature
    if known is not None and slice_.settings.named:
        return known.colors
    return colors_in_order(state.name for state in slice_.states)


def colors_in_order(names: Iterable[str]) -> dict[str, str]:
    """Distinct colors by name, in order; the members of a pair share one, and so do states of one name."""
    return dict(zip(dict.fromkeys(base_name(name) for name in names), cycle(PALETTE), strict=False))


def label_of(name: str) -> str:
    """A state's name as it is printed: 'A2+-' as A2±, 'A2-' with a true minus sign; the number of 'W:2' stays."""
    check_type("name", name, str, "the name of a state")
    name, colon, number = name.partition(":")
    if colon:
        return f"{label_of(name)}:{number}"
    if name.endswith("+-"):
        return name[:-2] + "±"
    return name[:-1] + "−" if name.endswith("-") else name


def styled() -> AbstractContextManager[None]:
    """The style of this package for the time of a `with` block; global settings are left alone."""
    import matplotlib as mpl

    return mpl.rc_context(RC)


def new_figure(width: float, height: float) -> Figure:
    """A figure (inches) that needs no display and is not registered with pyplot."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(width, height))
    FigureCanvasAgg(fig)
    return fig


def check_axes(ax: object) -> None:
    """ValueError for what is no axes to draw on; None stands for new ones."""
    if ax is not None:
        check_has("ax", ax, ("plot", "figure"), "axes of matplotlib")


def check_color(color: object) -> object:
    """The color, or ValueError for what is none of matplotlib's."""
    from matplotlib.colors import is_color_like

    if not is_color_like(color):
        raise ValueError(f"color: expected a color of matplotlib, got {shown(color)}")
    return color


def save_figure(fig: Figure | Axes, path: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Write a figure as PNG (200 dpi) and as PDF, the same bytes for the same figure, and close it.

    Each file appears at once: who reads meanwhile, or looks after a kill, finds the older one or the new one whole.

    Parameters
    ----------
    fig : the figure, or axes of it.
    path : where to; a suffix .png or .pdf is ignored.

    Returns
    -------
    the paths of the PNG and of the PDF.

    Raises
    ------
    OSError
        when a file cannot be written; an older one is untouched then.
    """
    from rodatlas.files import replace_file

    check_has("fig", fig, ("figure",), "a figure or axes of matplotlib")
    figure: Any = fig.figure  # that of a figure is itself
    target = Path(path)
    stem = target.with_suffix("") if target.suffix.lower() in (".png", ".pdf") else target
    png, pdf = io.BytesIO(), io.BytesIO()
    with styled():
        figure.savefig(png, format="png", dpi=200, metadata={"Software": None})
        figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close(figure)
    one, two = (stem.parent / (stem.name + suffix) for suffix in (".png", ".pdf"))
    return replace_file(one, png.getvalue()), replace_file(two, pdf.getvalue())
