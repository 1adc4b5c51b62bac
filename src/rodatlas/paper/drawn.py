"""What a figure of the paper becomes: a drawing, what is on it, and its numbers beside those of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Known:
    """A number that is known from elsewhere.

    Attributes
    ----------
    value, resolution : the number, and by how much it may differ through rounding alone.
    source : 'paper' (given there, read to the resolution), 'independent' (computed by two other programs) or
        'closed form'.
    """

    value: float
    resolution: float
    source: str


@dataclass(frozen=True)
class Number:
    """A number that belongs to a figure.

    Attributes
    ----------
    quantity : what it is, in words. value : ours. unit : '' for a pure number or one in units of L, GJ/L, ...
    key : of the same number in `known.toml`, '' when it is known from nowhere else.
    """

    quantity: str
    value: float
    unit: str = ""
    key: str = ""

    @property
    def known(self) -> Known | None:
        """The number as known from elsewhere."""
        return known_numbers()[self.key] if self.key else None

    @property
    def difference(self) -> float | None:
        """Ours less the known one."""
        return None if self.known is None else self.value - self.known.value

    @property
    def agrees(self) -> bool | None:
        """Whether the two are equal to the resolution of the known one."""
        known = self.known
        return None if known is None else abs(self.value - known.value) <= known.resolution * (1.0 + 1e-9)

    def to_json(self) -> dict[str, Any]:
        known = self.known
        out: dict[str, Any] = {"quantity": self.quantity, "value": self.value, "unit": self.unit}
        if known is not None:
            out["known"] = {"value": known.value, "resolution": known.resolution, "source": known.source}
            out |= {"difference": self.difference, "agrees": self.agrees}
        return out


@dataclass(frozen=True)
class Drawn:
    """A figure with its caption, numbers and remarks.

    Attributes
    ----------
    remarks : sentences about what differs from the paper, or what the computation adds to it.
    """

    figure: Figure
    caption: str
    numbers: tuple[Number, ...] = ()
    remarks: tuple[str, ...] = ()


@lru_cache(maxsize=1)
def known_numbers() -> dict[str, Known]:
    """Numbers known from elsewhere by key, from the table `known.toml` of this package."""
    import tomllib

    table = tomllib.loads(files(__package__).joinpath("known.toml").read_text(encoding="utf-8"))
    return {key: Known(**entry) for key, entry in table["number"].items()}
