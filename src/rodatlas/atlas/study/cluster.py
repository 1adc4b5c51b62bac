"""Workers on other machines, through Dask: those of a scheduler that is running, or of jobs of a batch system.

Results do not travel: workers write them into the folder of the study, which all machines must share.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodatlas import __version__
from rodatlas.atlas.study.cluster_settings import ClusterSettings
from rodatlas.atlas.study.local import ONE_THREAD
from rodatlas.atlas.study.worker import check_place

if TYPE_CHECKING:
    from distributed import Client

INSTALL = "pip install 'rodatlas[cluster]'"
LOGS = "jobs"
"""Folder in that of the study for what the jobs print."""
TIMEOUT = 20  # seconds to reach a scheduler


class DaskExecutor:
    """Calls on the workers of a Dask client, each with a name of its own so that none is taken for another.

    A worker that dies costs the call that it was at, which Dask starts again elsewhere; a call that takes several
    workers with it fails for good.
    """

    def __init__(self, client: Client):
        self._client, self._address = client, client.scheduler_info()["address"]
        self._pool = client.get_executor(pure=False)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Start a call.

        Raises
        ------
        ConnectionError
            when the scheduler is gone.
        """
        if self._client.status != "running":
            raise ConnectionError(f"the scheduler at {self._address} does not answer")
        future: Future[Any] = self._pool.submit(function, *arguments)
        return future

    def close(self) -> None:
        """Give up all calls that have not begun; those that run end on their own, and their results stay."""
        with suppress(Exception):  # a scheduler that is gone has given them up already
            self._pool.shutdown(wait=False)


@contextmanager
def cluster_executor(
    scheduler: str, settings: ClusterSettings | None, folder: Path, run: str, tell: Callable[[str], None]
) -> Iterator[DaskExecutor]:
    """An executor on a running scheduler, or on jobs that are started for it and end with it.

    Parameters
    ----------
    folder, run : of the study, to be seen by every worker.
    tell : told in one line who computes.

    Raises
    ------
    ValueError
        when a package is missing, the scheduler cannot be reached, or a worker does not see the folder.
    """
    try:
        from distributed import Client
    except ImportError:
        raise ValueError(f"scheduler: expected the package distributed, got none; {INSTALL}") from None
    with _jobs(scheduler, settings, folder / LOGS) as address:
        try:
            client = Client(address, timeout=TIMEOUT, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            line = " ".join(str(error).split())
            raise ValueError(f"scheduler: expected one that answers, got '{scheduler}' ({line})") from None
        try:
            _check_workers(client, folder, run, tell)
            executor = DaskExecutor(client)
            try:
                yield executor
            finally:
                executor.close()
        finally:
            with _quiet():
                client.close(timeout=TIMEOUT)


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the traceback that Dask prints when it is closed while it looks for a scheduler that is gone."""
    log = logging.getLogger("distributed.client")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        log.setLevel(before)


@contextmanager
def _jobs(scheduler: str, settings: ClusterSettings | None, logs: Path) -> Iterator[Any]:
    """The address of a scheduler, or a cluster of jobs."""
    if scheduler or settings is None:
        yield scheduler
        return
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise ValueError(f"cluster: expected the package dask-jobqueue, got none; {INSTALL}") from None
    cluster = SLURMCluster(**_options(settings), log_directory=str(logs))
    try:
        cluster.adapt(minimum_jobs=settings.jobs, maximum_jobs=settings.jobs)  # one that ends early is replaced
        yield cluster
    finally:
        cluster.close()


def _options(settings: ClusterSettings) -> dict[str, Any]:
    """Arguments of `SLURMCluster`: one process of one thread for each core."""
    exports = [f"export {name}={value}" for name, value in ONE_THREAD.items()]
    return {
        "cores": settings.cores, "processes": settings.cores, "memory": settings.memory,
        "walltime": settings.walltime, "queue": settings.queue or None, "account": settings.account or None,
        "interface": settings.interface or None, "job_extra_directives": list(settings.directives),
        "job_script_prologue": [*exports, *settings.prologue], "local_directory": settings.scratch or None,
        "python": sys.executable,
    }  # fmt: skip


def _check_workers(client: Client, folder: Path, run: str, tell: Callable[[str], None]) -> None:
    """Whether the workers that are there see the folder and run this program; those that come later check it too."""
    try:
        answers = client.run(_place_error, str(folder), run, __version__, on_error="return")
    except OSError as error:
        raise ValueError(f"scheduler: expected one that answers, got {' '.join(str(error).split())}") from None
    # a broken connection in place of an answer: the worker has gone
    found = {worker: answer for worker, answer in answers.items() if not isinstance(answer, OSError)}
    wrong = sorted({" ".join(str(error).split()) for error in found.values() if error})
    if wrong:
        raise ValueError(f"scheduler: expected workers that can do this study, got: {'; '.join(wrong)}")
    waiting = "" if found else " so far; waiting for the first"
    tell(f"{len(found)} workers at {client.scheduler_info()['address']}{waiting}")


def _place_error(folder: str, run: str, version: str) -> str:
    try:
        check_place(Path(folder), run, version)
    except RuntimeError as error:
        return str(error)
    return ""
