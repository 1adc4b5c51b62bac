"""What the figures of a slice read from it: any object with these attributes can be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rodatlas.continuation import Branch, Solution, SpecialPoint


class SettingsLike(Protocol):
    """The setting at which a slice was computed; angles in degrees, lengths in units of the rod length."""

    @property
    def angle_deg(self) -> float: ...
    @property
    def compression(self) -> float: ...
    @property
    def poisson(self) -> float: ...
    @property
    def shear_min(self) -> float: ...
    @property
    def shear_max(self) -> float: ...


class EventLike(Protocol):
    """A fold, pitchfork or branch point, with its number in the literature if it has one."""

    @property
    def kind(self) -> str: ...
    @property
    def special(self) -> SpecialPoint: ...
    @property
    def number(self) -> int | None: ...


class FollowedLike(Protocol):
    """A branch, and whether its reversal is another one."""

    @property
    def branch(self) -> Branch: ...
    @property
    def symmetric(self) -> bool: ...


class SliceBranchLike(Protocol):
    """A branch with its events."""

    @property
    def id(self) -> str: ...
    @property
    def followed(self) -> FollowedLike: ...
    @property
    def events(self) -> Sequence[EventLike]: ...


class StateLike(Protocol):
    """A named stable stretch of the branch with id `branch`, its solutions in order, both ends included; `contact` are
    the ranges of shear in which its band touches itself."""

    @property
    def name(self) -> str: ...
    @property
    def branch(self) -> str: ...
    @property
    def solutions(self) -> Sequence[Solution]: ...
    @property
    def contact(self) -> Sequence[tuple[float, float]]: ...


class SliceLike(Protocol):
    """Branches, their events, and the named stable states on them."""

    @property
    def settings(self) -> SettingsLike: ...
    @property
    def branches(self) -> Sequence[SliceBranchLike]: ...
    @property
    def states(self) -> Sequence[StateLike]: ...
