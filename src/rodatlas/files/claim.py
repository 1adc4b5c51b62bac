"""One process at a time makes a result; the system lets go of a claim when its process ends, however it does."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

PATIENCE = 1.0  # seconds for one that holds a folder for a moment, to write its catalogue
LOCK = ".lock"  # end of the hidden names of the files that are locked


class Held(ValueError):
    """Another process holds what was to be claimed."""


class _Claims:
    """Claims of this process: a lock for its threads and the locked file, by path."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._threads: dict[Path, threading.RLock] = {}
        self.open: dict[Path, tuple[IO[bytes] | None, int]] = {}  # file and how often it is claimed

    def thread_lock(self, path: Path) -> threading.RLock:
        with self._guard:
            return self._threads.setdefault(path, threading.RLock())


_CLAIMS = _Claims()


@contextmanager
def claimed(path: Path, say: Callable[[str], None] | None = None) -> Iterator[None]:
    """Hold a result for this process and thread while it is read, computed or written; others wait for it.

    May be nested. Where the file system has no locks, nothing is held.

    Parameters
    ----------
    path : of the result; it need not exist. A hidden file beside it is locked.
    say : told in one line that another run is being waited for.
    """
    place = path.resolve()
    lock = _CLAIMS.thread_lock(place)
    if not lock.acquire(blocking=False):
        _tell(path, say)
        lock.acquire()
    try:
        file, count = _CLAIMS.open.get(place, (None, 0))
        if count == 0:
            file = _locked(place, lambda: _tell(path, say))
        _CLAIMS.open[place] = file, count + 1
        try:
            yield
        finally:
            _let_go(place)
    finally:
        lock.release()


@contextmanager
def try_claim(path: Path) -> Iterator[bool]:
    """As :func:`claimed` without waiting: gives whether the result is held."""
    place = path.resolve()
    lock = _CLAIMS.thread_lock(place)
    if not lock.acquire(blocking=False):
        yield False
        return
    try:
        file, count = _CLAIMS.open.get(place, (None, 0))
        if count == 0:
            try:
                file = _locked(place, None)
            except Held:
                yield False
                return
        _CLAIMS.open[place] = file, count + 1
        try:
            yield True
        finally:
            _let_go(place)
    finally:
        lock.release()


@contextmanager
def alone_in(folder: Path, name: str = ".study.lock") -> Iterator[None]:
    """Hold a folder for one coordinator.

    Raises
    ------
    ValueError
        when another process holds it.
    """
    with open(folder / name, "a+b") as file:
        _lock_soon(file.fileno(), folder)
        yield


def _lock_soon(descriptor: int, folder: Path) -> None:
    """Lock within a moment; nothing where the file system has no locks. Held when another process keeps the folder."""
    end = time.monotonic() + PATIENCE
    while True:
        try:
            _lock(descriptor, wait=False)
        except BlockingIOError:
            if time.monotonic() > end:
                raise Held(f"out: expected a folder that no other study is running in, got {folder}") from None
            time.sleep(0.02)
            continue
        except OSError:
            pass
        return


def _tell(path: Path, say: Callable[[str], None] | None) -> None:
    if say is not None:
        say(f"another run is working on {path.name} in {path.parent}; waiting for it")


def _locked(place: Path, busy: Callable[[], None] | None) -> IO[bytes] | None:
    """The open, locked file beside a result; None where there are no locks. Without `busy`, :class:`Held` at once."""
    path = place.with_name(f".{place.name}{LOCK}")
    while True:
        try:
            file = open(path, "a+b")  # noqa: SIM115  closed when the claim ends
        except OSError:
            return None  # a folder that can only be read
        try:
            _wait_for(file.fileno(), place, busy)
        except BaseException as error:
            file.close()
            if isinstance(error, OSError):
                return None
            raise
        with suppress(FileNotFoundError):  # the one that held it has removed it: lock the one that is there now
            if os.path.samestat(os.fstat(file.fileno()), os.stat(path)):
                return file
        file.close()


def _wait_for(descriptor: int, place: Path, busy: Callable[[], None] | None) -> None:
    try:
        _lock(descriptor, wait=False)
    except BlockingIOError:
        if busy is None:
            raise Held(f"{place}: another run is working on it") from None
        busy()
        _lock(descriptor, wait=True)


def _let_go(place: Path) -> None:
    file, count = _CLAIMS.open[place]
    if count > 1:
        _CLAIMS.open[place] = file, count - 1
        return
    del _CLAIMS.open[place]
    if file is not None:
        with suppress(OSError):  # Windows removes no open file
            place.with_name(f".{place.name}{LOCK}").unlink()
        file.close()


def _lock(descriptor: int, wait: bool) -> None:
    """An exclusive lock; BlockingIOError when another process holds it and this one is not to wait."""
    if os.name == "nt":
        import msvcrt

        while True:
            try:
                msvcrt.locking(descriptor, msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]
                return
            except OSError:
                if not wait:
                    raise BlockingIOError from None
    else:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
