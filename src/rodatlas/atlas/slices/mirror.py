"""At psi0 = 0 the angle mirror (y -> -y) maps the slice to itself: which branch is the image of which."""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.atlas.slices.follow import Followed
from rodatlas.atlas.slices.match import lies_on
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import SpecialPoint, broken_at
from rodatlas.rods.perfectly_anisotropic import rod_problem
from rodatlas.rods.symmetry import mirror_angle

INVERSION = "angle mirror * reversal"
"""The symmetry of S+-, of the planar second mode and of all states on the zero-height axis."""

PARTS = (0.3, 0.55, 0.8)  # of a branch, at which it is compared with others: one may lie at a bifurcation


def mirror_partners(branches: Sequence[Followed], settings: SliceSettings) -> tuple[dict[str, str], list[str]]:
    """For each branch the id of that which the angle mirror makes of it or of its reversal; warnings where none does.

    A branch is its own partner when it maps to itself.
    """
    partners: dict[str, str] = {}
    for f in branches:
        if f.id in partners:
            continue
        found = next((g for part in PARTS for g in branches if _is_image(g, f, part, settings)), None)
        if found is not None:
            partners |= {f.id: found.id, found.id: f.id}
    alone = [f.id for f in branches if f.id not in partners]
    return partners, [f"branch {ident}: its image in the angle mirror is on no branch" for ident in alone]


def _is_image(one: Followed, other: Followed, part: float, settings: SliceSettings) -> bool:
    """Whether the image of the state at a part of the other branch lies on this branch."""
    if one.symmetric != other.symmetric:
        return False
    return lies_on(one.branch, mirror_angle(other.branch.points[int(part * len(other.branch))].solution), settings)


def broken_symmetries(special: SpecialPoint) -> tuple[str, ...]:
    """Products of declared symmetries that a branch through a branch point loses."""
    return broken_at(rod_problem(), special, among=(INVERSION,))
