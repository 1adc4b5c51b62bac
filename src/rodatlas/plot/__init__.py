"""Figures of slices, loci, phase diagrams and bands, and the surfaces behind them. Plotting only reads results.

One rule for all: what is drawn comes first, `ax` last. A function with `ax` draws on those axes, or on a figure of its
own when they are left out, and returns the axes. A function without `ax` makes a page of several panels and returns the
figure. :func:`save_figure` takes either. Parts of figures, in the modules, have the same order but need axes.

Above a figure stands its setting; axes have their units; folds are open disks, branch points filled ones, stable
stretches solid, unstable ones dashed.

matplotlib is imported when the first figure is drawn, not with this package.
"""

from rodatlas.plot.band.render import View, draw_triad, render_band
from rodatlas.plot.band.surface import BandSurface, band_surface
from rodatlas.plot.branches import draw_branch, draw_locus
from rodatlas.plot.look.style import color_of, colors_of, label_of, save_figure
from rodatlas.plot.planes.loci import draw_loci, draw_loci_figure
from rodatlas.plot.planes.phase import draw_phase, draw_phase_figure, draw_phase_states, draw_region
from rodatlas.plot.shapes.profiles import draw_profiles
from rodatlas.plot.slices.diagram import draw_slice, draw_slice_figure

__all__ = [
    "BandSurface", "View", "band_surface", "color_of", "colors_of", "draw_branch", "draw_loci", "draw_loci_figure",
    "draw_locus", "draw_phase", "draw_phase_figure", "draw_phase_states", "draw_profiles", "draw_region", "draw_slice",
    "draw_slice_figure", "draw_triad", "label_of", "render_band", "save_figure",
]  # fmt: skip
