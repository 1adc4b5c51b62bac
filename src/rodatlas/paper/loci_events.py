"""Special points of loci by what meets there, for the figures that show what happens around them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodatlas.atlas import Loci
    from rodatlas.atlas.loci.result import PieceEvent


def meeting(loci: Loci, kind: str, *numbers: int) -> PieceEvent | None:
    """The special point of a kind at which the loci of all these numbers meet; extrema are those in angle.

    Parameters
    ----------
    kind : 'cusp', 'extremum', 'criticality', 'coalescence' or 'crossing'.
    numbers : one or more; of a single number, its special point at the largest angle.
    """
    found = []
    for piece in loci.pieces:
        for e in piece.events:
            if e.event.kind != kind or (kind == "extremum" and e.event.parameter != "psi0"):
                continue
            if piece.number in numbers and set(numbers) <= {piece.number, *e.numbers}:
                found.append(e)
    return max(found, key=lambda e: e.angle_deg, default=None)
