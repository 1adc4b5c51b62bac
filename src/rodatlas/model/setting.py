"""Where a problem is looked at: values of its controls, and which of them varies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass


class Setting(Mapping[str, float]):
    """Values of controls by name, in the user's units; it does not change, and equal ones are one key of a dict.

    Examples
    --------
    >>> here = Setting({"angle": 15.0, "compression": 0.5})
    >>> here["angle"], here.replace(angle=30.0)["angle"]
    (15.0, 30.0)
    """

    __slots__ = ("_hash", "_values")

    def __init__(self, values: Mapping[str, float]):
        self._values = {name: float(value) for name, value in values.items()}
        self._hash = hash(frozenset(self._values.items()))

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Setting) and self._values == other._values

    def __repr__(self) -> str:
        return f"Setting({', '.join(f'{name} {value:g}' for name, value in self.items())})"

    def replace(self, **values: float) -> Setting:
        """With other values of some controls."""
        return Setting({**self._values, **values})

    def without(self, *names: str) -> Setting:
        """Without some controls, those that vary."""
        return Setting({name: value for name, value in self.items() if name not in names})


@dataclass(frozen=True)
class View:
    """Which control varies along a diagram, which quantity it is drawn against, and the second control of a plane."""

    along: str
    against: str
    second: str | None = None
