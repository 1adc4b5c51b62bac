"""Worker processes on this machine.

Each worker is a pool of a single process of its own: when one dies, exactly the task that it was at is known, and the
others go on (a pool of several processes gives up all of them).
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from types import TracebackType
from typing import Any

from rodatlas.continuation.checks import check_type

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "BLIS_NUM_THREADS",
     "VECLIB_MAXIMUM_THREADS"), "1",
)  # fmt: skip


class LocalExecutor:
    """Runs at most `capacity` calls at a time, each in a process of its own that stays for the next one.

    A process that dies makes its call fail with `BrokenExecutor`; the next call gets a new one. Workers run on one
    thread each, do not hear Ctrl-C, and leave when this process is gone, even by kill -9.

    Parameters
    ----------
    workers : number of processes; they start when they are needed.
    """

    def __init__(self, workers: int):
        check_type("workers", workers, int, "a whole number of at least 1")
        if workers < 1:
            raise ValueError(f"workers: expected a number of at least 1, got {workers}")
        self._slots = [_Slot() for _ in range(workers)]

    def __repr__(self) -> str:
        return f"LocalExecutor({self.capacity} workers, {sum(not s.idle for s in self._slots)} busy)"

    @property
    def capacity(self) -> int:
        """Number of calls that can run at a time."""
        return len(self._slots)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Start a call in an idle worker.

        Raises
        ------
        RuntimeError
            when all workers are busy.
        """
        for slot in self._slots:
            if slot.idle:
                return slot.submit(function, *arguments)
        raise RuntimeError(f"all {self.capacity} workers are busy: wait for one of their calls")

    def close(self) -> None:
        """End all workers at once, whatever they are at."""
        for slot in self._slots:
            slot.close()

    def __enter__(self) -> LocalExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Slot:
    """One worker: its pool, its process id, and the call that it is at."""

    def __init__(self) -> None:
        self._pool: ProcessPoolExecutor | None = None
        self._pid: Future[int] | None = None
        self._call: Future[Any] | None = None

    @property
    def idle(self) -> bool:
        return self._call is None or self._call.done()

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        if self._pool is not None:
            with suppress(BrokenExecutor):
                self._call = self._pool.submit(function, *arguments)
                return self._call
            self._pool.shutdown(wait=False)
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_prepare)
        with _quiet_start():
            self._pid = self._pool.submit(os.getpid)
        self._call = self._pool.submit(function, *arguments)
        return self._call

    def close(self) -> None:
        if self._pool is None:
            return
        if self._pid is not None and self._pid.done() and self._pid.exception() is None:
            with suppress(OSError):
                os.kill(self._pid.result(), signal.SIGTERM if os.name == "nt" else signal.SIGKILL)
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._pool = self._pid = self._call = None


@contextmanager
def _quiet_start() -> Iterator[None]:
    """A process started inside has one thread for linear algebra and never hears Ctrl-C.

    The environment counts before its first import; a blocked signal is inherited, and one that arrives meanwhile is
    delivered to this process afterwards.
    """
    before = {key: os.environ.get(key) for key in ONE_THREAD}
    masked = hasattr(signal, "pthread_sigmask")
    if masked:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # starting it unblocks the signal
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for key, value in before.items():
            if value is None:
                del os.environ[key]
            else:
                os.environ[key] = value
        if masked:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _prepare() -> None:
    """First thing in a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    """End this process as soon as the one that started it is gone."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
