"""How W is lost at the largest clamp angle at which it is stable without shear: its critical mode."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.names.yu_hanna import COLORS

if TYPE_CHECKING:
    from rodatlas.atlas import Loci
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources
    from rodatlas.rods import Mode

AMPLITUDE = 0.12  # largest displacement of the drawn bands [L]
BEYOND_DEG = 1.0
NO_SHEAR = 1e-5
LARGEST_ANGLE_DEG = 89.0


def draw(sources: Sources) -> Drawn:
    """The planar W at its loss of stability, moved along the mode to both sides, and the mode along the band."""
    from rodatlas.plot.shapes.modes import draw_mode
    from rodatlas.rods import critical_mode

    mode = critical_mode(lost_at(sources.loci()))
    angle, planar = float(np.degrees(mode.solution["psi0"])), planar_limit()
    caption = (
        f"W without shear at {angle:.3f} degrees, where it loses stability, and the band moved along the critical "
        f"mode by {AMPLITUDE:g} L to both sides; displacement and rotation of the mode along the band."
    )
    figure = draw_mode(mode, AMPLITUDE, "W", COLORS["W"])
    return Drawn(figure, caption, numbers_of(angle, mode, planar), remarks_on(angle, mode, planar))


def lost_at(loci: Loci) -> Solution:
    """W where its locus 3 reaches dD = 0, its largest angle."""
    piece = loci.numbered(3)
    if piece is None or abs(piece.points[-1]["dD"]) > NO_SHEAR:
        raise ValueError(f"loci: expected locus 3 up to shear 0, got {loci!r}")
    return piece.points[-1]


def w_at(angle_deg: float) -> Solution:
    """W without shear."""
    from rodatlas.rods import Ends, state_at

    return state_at(Ends(angle_deg), "W")


def planar_limit() -> float:
    """The angle in degrees at which the curve of planar states W turns back: no planar W exists beyond."""
    from dataclasses import replace

    from rodatlas.continuation import MeshControl, StepControl, TraceOptions, trace
    from rodatlas.rods import rod_problem

    start = w_at(75.0)
    options = TraceOptions(
        mesh=MeshControl(tolerance=1e-8), step=StepControl(maximum=0.3), locate=("fold",),
        bounds={"psi0": (float(start["psi0"]) - 1e-9, float(np.radians(LARGEST_ANGLE_DEG)))},
    )  # fmt: skip
    branch = trace(rod_problem(), start, ("psi0",), replace(options, max_folds=0), both=False, direction=1.0)
    folds = branch.of_kind("fold")
    if not folds:
        raise ValueError(f"W: expected a fold of the planar curve below {LARGEST_ANGLE_DEG:g} degrees, got {branch!r}")
    return float(np.degrees(folds[0].solution["psi0"]))


def shares(mode: Mode) -> tuple[float, float]:
    """Parts of the squared displacement in the plane of the band (x, y) and normal to it (z)."""
    x, y, z = (float(np.trapezoid(u**2, mode.s)) for u in mode.displacement.T)
    return (x + y) / (x + y + z), z / (x + y + z)


def numbers_of(angle: float, mode: Mode, planar: float) -> tuple[Number, ...]:
    """Angle of the loss, share of the mode normal to the plane, eigenvalue, indices around, planar limit."""
    from rodatlas.rods import index_of

    before, beyond = (index_of(w_at(angle + d)).index for d in (-BEYOND_DEG, BEYOND_DEG))
    return (
        Number("W loses stability at", angle, "deg", "W-gone"),
        Number("share of the displacement of the mode normal to the plane of the band", shares(mode)[1]),
        Number("eigenvalue of the mode there", mode.eigenvalue, "GJ/L²"),
        Number(f"index of W {BEYOND_DEG:g} degree below", float(before)),
        Number(f"index of W {BEYOND_DEG:g} degree above", float(beyond)),
        Number("planar W exists up to", planar, "deg"),
    )


def remarks_on(angle: float, mode: Mode, planar: float) -> tuple[str, ...]:
    plane, normal = shares(mode)
    how = "out of the plane of the band" if normal > plane else "in the plane of the band"
    return (
        f"W is lost {how}, at {angle:.2f} degrees; the planar W goes on, unstable, to {planar:.2f} degrees. A planar "
        "analysis of the elastica does not see the loss.",
        f"The mode breaks: {', '.join(mode.breaks) or 'no symmetry'}.",
    )
