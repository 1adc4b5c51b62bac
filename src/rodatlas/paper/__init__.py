"""The paper as a guest: its band as settings (`band_slice`, `band_loci`, `band_phase`), its names, and its figures.

Each numerical figure of the paper is drawn anew, with its numbers beside the paper's.
The paper is T. Yu and J. A. Hanna, "Bifurcations of buckled, clamped anisotropic rods and thin bands under lateral
end translations". Each figure has a module of its own with a function `draw(sources, **options)`, loaded when it is
drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rodatlas.paper.drawn import Drawn
    from rodatlas.paper.model import band, band_loci, band_phase, band_slice
    from rodatlas.paper.sources import Sources

__all__ = [
    "ENTRIES", "NOT_DRAWN", "PAPER", "Entry", "band", "band_loci", "band_phase", "band_slice", "chosen", "figure_names",
]  # fmt: skip
PAPER = (
    'T. Yu and J. A. Hanna, "Bifurcations of buckled, clamped anisotropic rods and thin bands under lateral end '
    'translations"'
)


@dataclass(frozen=True)
class Entry:
    """A figure that can be drawn.

    Attributes
    ----------
    name : of the figure; its files are fig-NAME.png and .pdf.
    module : of this package, that has `draw`. options : further arguments of it.
    of_paper : the paper's number(s) of the figure, '' for one that the paper does not have.
    description : one line.
    needs : clamp angles in degrees, and largest shears or None, of the slices that it is drawn from.
    """

    name: str
    module: str
    of_paper: str
    description: str
    options: Mapping[str, Any] = field(default_factory=dict)
    needs: tuple[tuple[float, float | None], ...] = ()

    def draw(self, sources: Sources) -> Drawn:
        """Draw it from results that the folder has, or that are computed now."""
        return import_module(f"{__name__}.{self.module}").draw(sources, **self.options)


def _slice(angle_deg: float, of_paper: str, description: str, shear_max: float | None = None) -> Entry:
    options = {"angle_deg": angle_deg, "shear_max": shear_max}
    return Entry(f"slice-{angle_deg:g}", "slices", of_paper, description, options, ((angle_deg, shear_max),))


_LOCI = ((15.0, None), (55.0, None), (60.0, None))  # slices from which the loci are followed

ENTRIES = (
    Entry("setup", "setup", "1", "the set-up, with a U-like and an S-like band", needs=((30.0, None),)),
    Entry("states", "states", "2", "the band in all 13 states at 15 deg, and in S at 0 deg",
          needs=((15.0, None), (0.0, None))),
    _slice(0.0, "3", "0 deg: U and W mirror images, S on the axis, third mode, twisted loops"),
    _slice(5.0, "5", "5 deg: the mirror symmetry is broken; folds 5, 6 and 7 appear"),
    _slice(15.0, "7", "15 deg: the slice with all named states but S"),
    _slice(27.5, "8", "27.5 deg: 4 is subcritical, fold 12 exists, w is near U"),
    _slice(30.0, "10", "30 deg: U goes over into w"),
    _slice(37.0, "12", "37 deg: one path U-w-uUui and a short residual uUui"),
    _slice(45.0, "13", "45 deg: WS no longer stable, the residual gone"),
    _slice(55.0, "15", "55 deg: a short uUu; US turns back at high shear", 0.86),
    _slice(60.0, "16", "60 deg: uUu gone, fold 17 ends US"),
    Entry(
        "close-ups-28", "close_ups", "9", "27.5 to 28.5 deg: w meets U; folds 7 and 18, then pitchforks 4 and 9 vanish",
        {"meetings": (("extremum", ("13", "18")), ("cusp", ("7", "18")), ("extremum", ("4", "9"))),
         "numbers": (4, 7, 9, 18), "beyond": 0.5},
        _LOCI,
    ),
    Entry(
        "close-ups-44", "close_ups", "14", "around 44.2 deg: fold 14 passes pitchfork 10, then 8 and 10 vanish",
        {"meetings": (("coalescence", ("10", "14")), ("criticality", ("10",)), ("extremum", ("8", "10"))),
         "numbers": (8, 10, 14)},
        _LOCI,
    ),
    Entry("profiles", "profiles", "11", "the five stable states at 30 deg, dD = 0.625: force, strains, energy",
          needs=((30.0, None),)),
    Entry("snap", "snap", "17", "energy before and after the jump from US+ at fold 17, 60 deg", needs=((60.0, None),)),
    Entry("phase", "phase", "18", "the phase diagram: loci of 0 to 18 in clamp angle and shear, stable states"),
    Entry("poisson", "poisson", "25", "shear of the bifurcations at 15 deg against Poisson's ratio",
          needs=((15.0, None),)),
    Entry("sheared", "sheared", "27 (rod)", "45 deg at four shears: the rod's shapes, curvature and twist"),
    Entry("critical-mode", "critical_mode", "", "how W is lost near 77 deg: the mode out of its plane", needs=_LOCI),
)  # fmt: skip

NOT_DRAWN = {
    "4, 6": "with measured ranges, which the paper does not print; for yours: `rodatlas slice --overlay`",
    "19, 22": "wide bands: needs the Audoly-Neukirch or Wunderlich model",
    "20, 21": "slices of wide bands: needs the Audoly-Neukirch or Wunderlich model",
    "24": "a sketch of Euler angles and frames; the directors are in `setup`",
    "23": "paper models of limiting states: not computed",
    "26": "the square section: needs the anisotropic rod with kappa2",
    "27 (strips)": "needs the Wunderlich model; the rod is in `sheared`",
}


def figure_names() -> list[str]:
    """Names of all figures, in the order of the paper."""
    return [entry.name for entry in ENTRIES]


def chosen(wanted: Sequence[str]) -> list[Entry]:
    """Entries by name, all when none is named.

    Raises
    ------
    ValueError
        for a name that no figure has.
    """
    known = {entry.name: entry for entry in ENTRIES}
    for name in wanted:
        if name not in known:
            raise ValueError(f"figure: expected one of {', '.join(known)}, got '{name}'")
    return [known[name] for name in dict.fromkeys(wanted)] if wanted else list(ENTRIES)


if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Settings of the band, loaded when they are first asked for: a list of figures needs no solver."""
        if name not in ("band", "band_loci", "band_phase", "band_slice"):
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name)
        value = globals()[name] = getattr(import_module(f"{__name__}.model"), name)
        return value
