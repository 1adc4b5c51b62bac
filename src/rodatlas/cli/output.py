"""Files that the user names: a result never takes the place of another one, unless --overwrite says so."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodatlas.cli.common import writable_folder
from rodatlas.files import write_text

Identity = Mapping[str, object]
"""Everything that decides a result, as plain values."""


@dataclass(frozen=True)
class JsonTarget:
    """Where `--json` writes: nowhere (''), to stdout ('-') or to a file.

    Attributes
    ----------
    overwrite : whether a file that holds something else may be replaced.
    """

    text: str = ""
    overwrite: bool = False

    def __post_init__(self) -> None:
        if not self.is_file:
            return
        if Path(self.text).is_dir():
            raise ValueError(f"json: expected a file name or -, got the folder '{self.text}'")
        writable_folder(str(Path(self.text).parent), "json")

    @property
    def is_file(self) -> bool:
        return self.text not in ("", "-")

    @property
    def on_stdout(self) -> bool:
        """Whether stdout is taken, so that tables go to stderr."""
        return self.text == "-"

    def expect(self, identity: Identity) -> None:
        """Refuse, before any work is done, a file that holds another result.

        Raises
        ------
        ValueError
            when it is there, may not be replaced, and is not the JSON of a result of this identity.
        """
        path = Path(self.text)
        if not self.is_file or self.overwrite or not path.exists() or not path.is_file():
            return  # what is no ordinary file, /dev/null say, keeps nothing
        try:
            known = json.loads(path.read_text(encoding="utf-8"))["identity"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            known = None
        if known != json.loads(json.dumps(identity)):
            raise ValueError(f"json: expected a file that is new or holds this result, got '{path}' with something "
                             "else; --overwrite replaces it")  # fmt: skip

    def write(self, data: Mapping[str, Any], identity: Identity, indent: int | None = 1) -> None:
        """Write a result with its identity; a file appears at once."""
        if not self.text:
            return
        text = json_text(data, identity, indent)
        if self.on_stdout:
            sys.stdout.write(text)
        elif Path(self.text).exists() and not Path(self.text).is_file():
            Path(self.text).write_text(text, encoding="utf-8")
        else:
            self.expect(identity)  # another run may have written it meanwhile
            write_text(self.text, text)


def json_text(data: Mapping[str, Any], identity: Identity, indent: int | None = 1) -> str:
    """A result and its identity as JSON."""
    return json.dumps({**data, "identity": dict(identity)}, indent=indent, ensure_ascii=False) + "\n"


def place_files(target: Path, write: Callable[[Path], Sequence[Path]], overwrite: bool) -> list[Path]:
    """Write files into a hidden folder beside their place, and move them all there, or none.

    Parameters
    ----------
    target : name from which the writer makes the names of its files.
    write : gets the target in the hidden folder; returns the files that it wrote there.
    overwrite : whether files with other bytes may be replaced.

    Returns
    -------
    the files.

    Raises
    ------
    ValueError
        when one is there already and differs.
    """
    with tempfile.TemporaryDirectory(prefix=f".{target.stem[:40]}.", suffix=".partial", dir=target.parent) as hidden:
        made = {path: target.parent / path.name for path in write(Path(hidden) / target.name)}
        for path, place in made.items():
            if not overwrite and place.exists() and place.is_file() and place.read_bytes() != path.read_bytes():
                raise ValueError(f"out: expected a file that is new or holds this result, got '{place}' with something "
                                 "else; --overwrite replaces it")  # fmt: skip
        for path, place in made.items():
            os.replace(path, place)
    return list(made.values())
