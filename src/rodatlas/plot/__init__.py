"""Figures of slices, loci and bands, and the surfaces behind them. Plotting only reads results.

matplotlib is imported when the first figure is drawn, not with this package.
"""

from rodatlas.plot.diagram import draw_slice, draw_slice_figure
from rodatlas.plot.loci import draw_loci, draw_loci_figure
from rodatlas.plot.phase import draw_phase, draw_phase_figure, draw_phase_states
from rodatlas.plot.profiles import draw_profiles
from rodatlas.plot.render import View, render_band
from rodatlas.plot.style import color_of, label_of, save_figure
from rodatlas.plot.surface import BandSurface, band_surface

__all__ = [
    "BandSurface", "View", "band_surface", "color_of", "draw_loci", "draw_loci_figure", "draw_phase",
    "draw_phase_figure", "draw_phase_states", "draw_profiles", "draw_slice", "draw_slice_figure", "label_of",
    "render_band", "save_figure",
]  # fmt: skip
