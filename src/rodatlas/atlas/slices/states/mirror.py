"""Where a further symmetry leaves a setting alone it maps the slice to itself: which branch is the image of which.

The angle mirror of a band does so between level clamps: it makes W of U, and the slice shows both.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodatlas.atlas.slices.branches.follow import SHARES
from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.atlas.slices.branches.match import lies_on
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.continuation import SpecialPoint, broken_at, image
from rodatlas.model.orbit import pairing


def further_symmetries(settings: SliceSettings) -> tuple[str, ...]:
    """Declared symmetries, other than those that pair states, that leave the setting and what varies alone."""
    return tuple(name for name in settings.symmetries if name not in pairing(settings.model))


def mirror_partners(
    branches: Sequence[Followed], symmetry: str, settings: SliceSettings
) -> tuple[dict[str, str], list[str]]:
    """For each branch the id of that which a symmetry makes of it or of a member of it; warnings where none does.

    A branch is its own partner when it maps to itself.
    """
    partners: dict[str, str] = {}
    for f in branches:
        if f.id in partners:
            continue
        found = next((g for part in SHARES for g in branches if _is_image(g, f, symmetry, part, settings)), None)
        if found is not None:
            partners |= {f.id: found.id, found.id: f.id}
    alone = [f.id for f in branches if f.id not in partners]
    return partners, [f"branch {ident}: its image in the {symmetry} is on no branch" for ident in alone]


def _is_image(one: Followed, other: Followed, symmetry: str, part: float, settings: SliceSettings) -> bool:
    """Whether the image of the state at a part of the other branch lies on this branch."""
    if one.symmetries != other.symmetries:
        return False
    state = other.branch.points[int(part * len(other.branch))].solution
    return lies_on(one.branch, image(settings.model.problem, symmetry, state), settings)


def broken_products(special: SpecialPoint, settings: SliceSettings) -> tuple[str, ...]:
    """Products of a further and a pairing symmetry that a branch through a branch point loses.

    'angle mirror * reversal' is that of S+-, of the planar second mode, and of all states at zero height.
    """
    among = [f"{one} * {two}" for one in further_symmetries(settings) for two in pairing(settings.local)]
    return broken_at(settings.model.problem, special, among=among) if among else ()
