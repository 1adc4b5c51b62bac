"""What a kind of task is: how its settings are made, named and computed. One small entry for each kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rodatlas.files import digest
from rodatlas.progress import Progress

if TYPE_CHECKING:
    import h5py


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


@dataclass(frozen=True)
class Kind:
    """A kind of task.

    Attributes
    ----------
    name : 'slice', say.
    section : name of its tables in study files.
    schema : that of its result files.
    settings : class of its settings.
    make : the settings from named numbers and texts. Its parameters are what a table in a study file may hold: their
        annotations (float, int, bool, str) are checked, those without a default are required.
    stem : first part of the names of the files, readable.
    requires : settings of results that must be there before, of whatever kind.
    compute : computes and writes `Workplace.path`, atomically.
    contents : what is in a file, in a few words.

    Functions are those of modules, so that a task can be sent to another process.
    """

    name: str
    section: str
    schema: str
    settings: type
    make: Callable[..., Any]
    stem: Callable[[Any], str]
    requires: Callable[[Any], tuple[Settings, ...]]
    compute: Callable[[Any, Workplace], None]
    contents: Callable[[h5py.File], str]

    def file_stem(self, settings: Settings) -> str:
        """Name of the files of a result: readable, and eight digits of a hash of everything that decides its numbers.

        Results of other settings, tolerances or versions of the program therefore never share a name.
        """
        return f"{self.stem(settings)}-{digest(settings.identity())}"


def nothing_required(settings: Settings) -> tuple[Settings, ...]:
    """For kinds that need no other results."""
    return ()
