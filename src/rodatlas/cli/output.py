"""Files that the user names: checked before any work, and never in the place of another result without --overwrite."""

from __future__ import annotations

import errno
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rodatlas.cli.common import note, shown

Identity = Mapping[str, object]
"""Everything that decides a result, as plain values."""

RESULTS = (".h5", ".png", ".pdf", ".sqlite")  # endings of other files that commands write
KEPT = "expected a file that is new or holds this result, got '{}' with something else; --overwrite replaces it"


@dataclass(frozen=True)
class JsonTarget:
    """Where `--json` writes: to a file, to stdout, or nowhere; see :func:`json_target`."""

    path: Path | None = None
    on_stdout: bool = False
    overwrite: bool = False

    def expect(self, identity: Identity, own: Iterable[Path] = ()) -> None:
        """Refuse, before any work is done, a file that holds anything else than a result of this identity.

        Parameters
        ----------
        own : files that the command writes with another content; those are refused in any case.
        """
        if self.path is None:
            return
        if os.path.realpath(self.path) in {os.path.realpath(p) for p in own}:
            name = shown(str(self.path))
            raise ValueError(f"json: expected a file that the command does not write itself, got '{name}'")
        if self.overwrite or not self.path.is_file():
            return
        try:
            known = json.loads(self.path.read_text(encoding="utf-8"))["identity"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            known = None
        if known != _plain(identity):
            raise ValueError(f"json: {KEPT.format(shown(str(self.path)))}")

    def write(self, text: str, identity: Identity) -> None:
        """Write a result, see :func:`json_text`; a file appears at once."""
        from rodatlas.files import claimed, write_text

        if self.on_stdout:
            sys.stdout.write(text)
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if _is_device(self.path):
                self.path.write_text(text, encoding="utf-8")  # /dev/null and the like are written to, not replaced
                return
            with claimed(self.path):
                self.expect(identity)  # another run may have written it meanwhile
                write_text(self.path, text)
        except OSError as error:
            why = error.strerror
            raise ValueError(f"json: expected a file that can be written, got '{self.path}' ({why})") from None


def json_target(text: str | None, overwrite: bool = False) -> JsonTarget:
    """The file for --json, checked before any work is done; nothing is made yet."""
    if text is None or text == "-":
        return JsonTarget(None, text == "-")
    if not text.strip():
        raise ValueError(f"json: expected a file name or -, got '{text}'")
    path = Path(text)
    if _is_folder(path):
        raise ValueError(f"json: expected a file name or -, got the folder '{shown(text)}'")
    if path.suffix.lower() in RESULTS:
        raise ValueError(f"json: expected a name for JSON, got '{shown(text)}', which ends as other results do")
    if not _is_device(path):
        _place(str(path.parent), "json", "a folder that can be written")
        _check_name(path, "json")
    return JsonTarget(path, False, overwrite)


def write_own_json(path: Path, text: str, identity: Identity) -> None:
    """Write a result, see :func:`json_text`, under the name that the command gives it.

    A file of that name with anything else, or with the result of another version, is renamed, and the user told so.
    """
    from rodatlas.files import claimed, keep_other_json, write_text

    with claimed(path, note):
        if aside := keep_other_json(path, lambda known: known["identity"] == _plain(identity)):
            note(f"{path.name} held something else, which is kept as {aside.name}")
        write_text(path, text)


def _plain(identity: Identity) -> Any:
    """An identity as it is read back."""
    return json.loads(json.dumps(dict(identity)))


def json_text(data: Mapping[str, Any], identity: Identity, indent: int | None = 1) -> str:
    """A result and its identity as JSON."""
    return json.dumps({**data, "identity": dict(identity)}, indent=indent, ensure_ascii=False) + "\n"


def writable_folder(text: str, field: str = "out") -> Path:
    """A folder that exists (made when missing) and can be written to.

    It is the last thing to check, so that wrong input leaves no empty folder.
    """
    from rodatlas.files import remove_partials

    folder = _place(text, field, "a folder that can be written")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _probe(folder)
        remove_partials(folder)
    except OSError as error:
        raise ValueError(
            f"{field}: expected a folder that can be written, got '{shown(text)}' ({error.strerror})"
        ) from None
    return folder


def file_target(text: str, field: str = "out") -> Path:
    """The file for --out, checked before any work is done; nothing is made yet."""
    path = Path(text)
    if not text.strip() or text == "-":  # which stands for stdout elsewhere
        raise ValueError(f"{field}: expected a file name, got '{text}'")
    if _is_folder(path):
        raise ValueError(f"{field}: expected a file name, got the folder '{shown(text)}'")
    if _is_device(path):
        raise ValueError(f"{field}: expected a file name, got '{shown(text)}', which is no plain file")
    _place(str(path.parent), field, "a folder that can be written")
    _check_name(path, field)
    return path


def place_files(target: Path, write: Callable[[Path], Sequence[Path]], overwrite: bool) -> list[Path]:
    """Write files into a hidden folder beside their place, and move them all there, or none.

    Parameters
    ----------
    target : name from which the writer makes the names of its files.
    write : gets the target in the hidden folder; returns the files that it wrote there.
    overwrite : whether files with other bytes may be replaced.

    Raises
    ------
    ValueError
        when one is there already and differs.
    """
    from rodatlas.files import claimed

    target.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{target.stem[:40]}."
    with (
        tempfile.TemporaryDirectory(prefix=prefix, suffix=".partial", dir=target.parent) as hidden,
        ExitStack() as claims,
    ):
        made = {path: target.parent / path.name for path in write(Path(hidden) / target.name)}
        for place in sorted(made.values()):  # in order, so that two runs never wait for each other
            claims.enter_context(claimed(place, note))
        for path, place in made.items():
            if place.exists() and not place.is_file():
                raise ValueError(f"out: expected file names that are free, got '{shown(str(place))}', which is no file")
            if not overwrite and place.is_file() and place.read_bytes() != path.read_bytes():
                raise ValueError(f"out: {KEPT.format(shown(str(place)))}")
        for path, place in made.items():
            os.replace(path, place)
    return list(made.values())


def _is_folder(path: Path) -> bool:
    """Whether a path leads to a folder; one that the system refuses does not."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def _is_device(path: Path) -> bool:
    """Whether a path leads to something that is neither a file nor a folder: /dev/null, a pipe."""
    try:
        return path.exists() and not path.is_file() and not path.is_dir()
    except (OSError, ValueError):
        return False


def _look(path: Path) -> None:
    """OSError or ValueError where the system does not take a name; a missing file is none."""
    with suppress(FileNotFoundError, NotADirectoryError):
        os.lstat(path)


def _place(text: str, field: str, what: str) -> Path:
    """A folder that is there or can be made, by a trial in what is there of it."""
    folder = Path(text)
    try:
        if not text.strip() or text == "-":
            raise ValueError
        _look(folder)
        known = next(p for p in (folder, *folder.parents) if os.path.lexists(p))
        _probe(known)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        got = f"'{shown(text)}'" + (f" ({why})" if why else "")
        raise ValueError(f"{field}: expected {what}, got {got}") from None
    return folder


def _probe(folder: Path) -> None:
    """OSError where a folder cannot be written to."""
    from rodatlas.files.atomic import partial_of

    probe = partial_of(folder / "rodatlas")  # a name of its own: process ids repeat where machines share a folder
    probe.touch()
    probe.unlink()


def _check_name(path: Path, field: str) -> None:
    """ValueError where the system does not take the name of a file, or the file must not be replaced."""
    try:
        _look(path.with_name(f".{path.name}.{'0' * 12}.partial"))  # as it is called while it is written
        if path.exists() and not os.access(path, os.W_OK):
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise ValueError(f"{field}: expected a file that can be written, got '{shown(str(path))}' ({why})") from None
