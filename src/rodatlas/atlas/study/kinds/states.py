"""Searches for all states at one setting as tasks."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass

from rodatlas import __version__
from rodatlas.atlas import results
from rodatlas.atlas.study.kinds.base import Kind, Workplace, nothing_required
from rodatlas.continuation.checks import WrongInput
from rodatlas.files import exact
from rodatlas.rods.band import check_number, check_poisson
from rodatlas.rods.ends import Ends
from rodatlas.rods.model import CONTROLS
from rodatlas.states.discover import CLASSES, find_states
from rodatlas.states.store import ALGORITHM, save_discovery


@dataclass(frozen=True)
class StatesSettings:
    """A search for states; see :func:`rodatlas.states.find_states`.

    Attributes
    ----------
    angle_deg, shear, compression, poisson : the setting.
    classes : '+', '-' or 'both'.
    starts : for each class; 0 stands for the default.
    """

    angle_deg: float
    shear: float
    compression: float = 0.5
    poisson: float = 0.25
    classes: str = "both"
    starts: int = 0
    stable_only: bool = False
    tolerance: float = 1e-8
    seed: int = 1

    def __post_init__(self) -> None:
        Ends(self.angle_deg, self.compression, self.shear)
        check_poisson(self.poisson)
        if self.classes not in CLASSES:
            raise WrongInput("class", f"expected +, - or both, got '{self.classes}'")
        check_number("starts", self.starts, 0, 10**7, "a whole number of at least 1 (0: the default)")
        check_number("tol", self.tolerance, 1e-10, 1e-6, "a number between 1e-10 and 1e-06")
        check_number("seed", self.seed, 0, 2**31, "a whole number of at least 0")

    def identity(self) -> dict[str, object]:
        """Everything that decides the numbers, as plain values: the fields, the version of program and algorithm."""
        return {"rodatlas": __version__, "algorithm": ALGORITHM, **asdict(self)}


def _make(
    angle: float, shear: float, compression: float = 0.5, poisson: float = 0.25, classes: str = "both",
    starts: int = 0, stable_only: bool = False, tolerance: float = 1e-8, seed: int = 1,
) -> StatesSettings:  # fmt: skip
    return StatesSettings(angle, shear, compression, poisson, classes, starts, stable_only, tolerance, seed)


def _stem(settings: StatesSettings) -> str:
    values = {"poisson": settings.poisson, "compression": settings.compression}
    other = [f"-{c.in_files}{exact(values[c.name])}" for c in reversed(CONTROLS) if c.name in values
             and values[c.name] != c.default]  # fmt: skip
    shear = next(c for c in CONTROLS if c.name == "shear")
    return f"states-{exact(settings.angle_deg)}-{shear.in_files}{exact(settings.shear)}{''.join(other)}"


def _compute(settings: StatesSettings, work: Workplace) -> None:
    begin = time.perf_counter()
    found = find_states(
        Ends(settings.angle_deg, settings.compression, settings.shear), settings.poisson, settings.classes,
        settings.starts or None, stable_only=settings.stable_only, tolerance=settings.tolerance, seed=settings.seed,
        progress=work.progress,
    )  # fmt: skip
    save_discovery(work.path, found, settings.identity(), time.perf_counter() - begin)


STATES = Kind(results.STATES, "states", StatesSettings, _make, _stem, nothing_required, _compute)
