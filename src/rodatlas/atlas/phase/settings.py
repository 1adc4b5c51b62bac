"""What a phase diagram is computed for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np

from rodatlas.atlas.loci.settings import LociSettings, PlaneSettings
from rodatlas.atlas.slices.settings import SliceSettings
from rodatlas.files import exact

EDGE = 256  # vertices of a border of the plane that is not straight


@dataclass(frozen=True, repr=False)
class PhaseSettings(PlaneSettings):
    """A plane of two controls of a model, to be cut into regions of stability.

    Attributes
    ----------
    loci_low, loci_high : range of the second control in which loci are followed, so that windows of a plane and the
        whole of it share them; that of the plane by default.

    Examples
    --------
    >>> PhaseSettings.of(model_named("band"), second="compression", angle=20.0)
    """

    loci_low: float | None = None
    loci_high: float | None = None

    def __post_init__(self) -> None:
        for field, mine in (("loci_low", self.second_low), ("loci_high", self.second_high)):
            if getattr(self, field) is None:
                object.__setattr__(self, field, mine)
        super().__post_init__()

    @property
    def loci(self) -> LociSettings:
        """Settings of the loci."""
        plain = {f.name: getattr(self, f.name) for f in fields(PlaneSettings)}
        return LociSettings(**plain | {"second_low": self.loci_low, "second_high": self.loci_high})

    def range_at(self, second: float) -> tuple[float, float]:
        """Range of what varies along slices, smaller than that of the plane where its limits are."""
        low, high, _ = self.along_control.limits({**self.setting, self.second: second})
        anchor_low, anchor_high, _ = self.along_control.limits({**self.setting, self.second: self.anchor})
        if (low, high) == (anchor_low, anchor_high) or not math.isfinite(high):
            return max(self.low, low), min(self.high, high)
        share = high / anchor_high if anchor_high > 0 else 1.0
        return max(self.low, self.low * share), min(self.high, self.high * share)

    @property
    def region(self) -> np.ndarray:
        """(n, 2) border of the plane, closed: its frame, or what of it is inside the limits."""
        second = np.linspace(self.second_low, self.second_high, EDGE)
        ends = np.array([self.range_at(float(x)) for x in second])
        if (ends == ends[0]).all():
            second, ends = second[[0, -1]], ends[[0, -1]]
        below, above = np.column_stack([second, ends[:, 0]]), np.column_stack([second, ends[:, 1]])[::-1]
        return np.vstack([below, above, below[:1]])

    def slice_at(self, second: float) -> SliceSettings:
        """Settings of a slice over the whole range.

        Without a search for states: what one slice misses shows in the comparison with the others.
        """
        low, high = self.range_at(second)
        found = super().slice_at(second)
        return replace(found, low=low, high=high, search=0)

    def window(self, second_low: float, second_high: float) -> PhaseSettings:
        """A part of the plane, with the same loci."""
        return replace(self, second_low=second_low, second_high=second_high)

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values: those of its slices and loci, too."""
        return {**self._identity("atlas/loci", "atlas/phase"), "loci_low": self.loci_low, "loci_high": self.loci_high}

    @classmethod
    def from_identity(cls, identity: Mapping[str, Any]) -> Self:
        """The settings behind :meth:`identity`; ValueError when nobody knows the model."""
        return replace(super().from_identity(identity), loci_low=identity["loci_low"], loci_high=identity["loci_high"])

    @property
    def stem(self) -> str:
        """Name of the files of a phase diagram: what differs from the defaults."""
        loci = self.loci
        stem = "phase" + loci.stem().removeprefix("loci")
        whole = (self.second_low, self.second_high) == (self.loci_low, self.loci_high)
        return stem if whole else f"{stem}-from{exact(self.second_low)}-to{exact(self.second_high)}"
