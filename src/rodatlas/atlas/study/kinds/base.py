"""What a kind of task is: how its settings are made, named and computed. One small entry for each kind."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, get_type_hints

from rodatlas.atlas.results import ResultKind
from rodatlas.continuation.checks import WrongInput
from rodatlas.files import digest
from rodatlas.progress import Progress

if TYPE_CHECKING:
    from rodatlas.model import Control, Model


class Settings(Protocol):
    """Everything that decides the numbers of a result."""

    def identity(self) -> dict[str, object]:
        """The fields as plain values, and the version of the program."""
        ...


@dataclass(frozen=True)
class Workplace:
    """Where one task is computed.

    Attributes
    ----------
    folder : that of the study; results lie in it side by side.
    stem : name of the result without its suffix; unfinished branches lie in a folder of that name.
    progress : called as the work goes on.
    say : told in one line what the user should know, of damaged files for instance.
    fresh : compute everything again, even what is there.
    """

    folder: Path
    stem: str
    progress: Progress
    say: Callable[[str], None]
    fresh: bool = False

    @property
    def path(self) -> Path:
        """The file of the result."""
        return self.folder / f"{self.stem}.h5"


REQUIRED = inspect.Parameter.empty
Parameter = tuple[type, Any]
"""Type and default of a value in a study file."""
BAND = "band"  # the model of tables that name none


@dataclass(frozen=True)
class Kind:
    """A kind of task.

    Attributes
    ----------
    result : what it computes.
    section : name of its tables in study files.
    settings : class of its settings.
    make : the settings from named numbers and texts. Its named parameters are what a table in a study file may hold:
        their annotations (float, int, bool, str) are checked, those without a default are required.
    stem : first part of the names of the files, readable.
    requires : settings of results that must be there before, of whatever kind.
    compute : computes and writes `Workplace.path`, atomically.
    controls : whether tables may hold controls of the model too, and ranges of them, which `make` takes by keyword.

    Functions are those of modules, so that a task can be sent to another process.
    """

    result: ResultKind
    section: str
    settings: type
    make: Callable[..., Any]
    stem: Callable[[Any], str]
    requires: Callable[[Any], tuple[Settings, ...]]
    compute: Callable[[Any, Workplace], None]
    controls: bool = False

    @property
    def name(self) -> str:
        """What it is called, as its result: 'slice', say."""
        return self.result.word

    def parameters(self, model: Model) -> dict[str, Parameter]:
        """What a table in a study file may hold for a model: type and default, `REQUIRED` where there is none."""
        return parameters_of(self.make) | (control_parameters(model) if self.controls else {})

    def file_stem(self, settings: Settings) -> str:
        """Name of the files of a result: readable, and eight digits of a hash of everything that decides its numbers.

        Results of other settings, tolerances or versions of the program therefore never share a name.
        """
        return f"{self.stem(settings)}-{digest(settings.identity())}"


def nothing_required(settings: Settings) -> tuple[Settings, ...]:
    """For kinds that need no other results."""
    return ()


def parameters_of(make: Callable[..., Any]) -> dict[str, Parameter]:
    """The named parameters of a function with their types and defaults; of 'float | None' the type is float."""
    hints = get_type_hints(make)
    named = [p for p in inspect.signature(make).parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
    return {p.name: (next(iter(getattr(hints[p.name], "__args__", (hints[p.name],)))), p.default) for p in named}


def control_parameters(model: Model) -> dict[str, Parameter]:
    """For each control of a model its value, and the ends of its range where it varies."""
    keys = [c.name.replace("-", "_") for c in model.controls]
    return {name: (float, None) for key in keys for name in (key, f"{key}_min", f"{key}_max")}


def divided(
    model: Model, varied: Sequence[Control], values: Mapping[str, float | None]
) -> tuple[dict[str, float], list[tuple[float | None, float | None]]]:
    """Values of fixed controls, and for each control that varies the ends of its range, None for those left out.

    Raises
    ------
    ValueError
        for the range of a control that is fixed, and where a control whose value stands in every name is left out.
    """
    given = {name: value for name, value in values.items() if value is not None}
    ranges = []
    for control in varied:
        key = control.name.replace("-", "_")
        ranges.append((given.pop(f"{key}_min", None), given.pop(f"{key}_max", None)))
    keys = [c.name.replace("-", "_") for c in model.controls]
    for name in given:
        if name not in keys:
            along = " and ".join(c.name for c in varied)
            raise WrongInput(name, f"expected the range of {along} only, which varies, got {given[name]:g}")
    moved = {c.parameter for c in varied}
    for control in model.controls:
        if control.short == "" and control.parameter not in moved and control.name.replace("-", "_") not in given:
            raise WrongInput(control.name, "expected a value, got none")
    return given, ranges
