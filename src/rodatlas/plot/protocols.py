"""What the figures of a slice read from it: any object with these attributes can be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rodatlas.continuation import Branch, Solution, SpecialPoint
    from rodatlas.model import Control, Model, Setting


class SettingsLike(Protocol):
    """What a slice was computed for; values are in the user's units."""

    @property
    def model(self) -> Model: ...
    @property
    def setting(self) -> Setting: ...
    @property
    def control(self) -> Control: ...
    @property
    def against(self) -> str: ...
    @property
    def low(self) -> float: ...
    @property
    def high(self) -> float: ...
    @property
    def named(self) -> bool: ...
    def value(self, solution: Solution) -> float: ...
    def response(self, solution: Solution) -> float: ...


class EventLike(Protocol):
    """A fold, pitchfork or branch point, with its number in the literature if it has one."""

    @property
    def kind(self) -> str: ...
    @property
    def special(self) -> SpecialPoint: ...
    @property
    def number(self) -> int | None: ...


class FollowedLike(Protocol):
    """A branch, the symmetries that its states have, and whether an image of it is another branch."""

    @property
    def branch(self) -> Branch: ...
    @property
    def symmetries(self) -> frozenset[str]: ...
    @property
    def pair(self) -> bool: ...


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
    the ranges of what varies in which its band touches itself."""

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
