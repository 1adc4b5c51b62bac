"""A kind of task for tests: quick branches of Bratu's problem, through the same store as the branches of a slice."""

from __future__ import annotations

import errno
import os
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from rodatlas import __version__
from rodatlas.atlas.cache import BRANCH, FolderCache
from rodatlas.atlas.results import ResultKind
from rodatlas.atlas.study.kinds import Kind
from rodatlas.atlas.study.kinds.base import nothing_required
from rodatlas.atlas.study.task import task_of
from rodatlas.continuation import BVP, MeshControl, Solution, TraceOptions, trace
from rodatlas.continuation.store.branch import write_branch
from rodatlas.continuation.store.hdf5 import atomic_hdf5

JOURNAL = "journal.txt"
BRANCHES = 3


@dataclass(frozen=True)
class CheapSettings:
    """`pause` seconds lie between two branches; `trouble` says what goes wrong."""

    number: int
    pause: float = 0.0
    trouble: str = ""

    def identity(self):
        return {"rodatlas": __version__, **asdict(self)}


def _compute(settings, work):
    if settings.trouble == "always":
        raise RuntimeError("this never works")
    if settings.trouble == "full disk":
        raise OSError(errno.ENOSPC, "No space left on device")
    if settings.trouble == "dies":
        os._exit(9)
    if settings.trouble == "dies once" and _first(work.folder / f"{work.stem}.mark"):
        os._exit(9)
    if settings.trouble == "fails once" and _first(work.folder / f"{work.stem}.mark"):
        raise RuntimeError("only the first time")
    cache = FolderCache(work.folder / work.stem, settings, say=work.say)
    branches = []
    for part in range(BRANCHES):
        work.progress(f"branch {part}", part, BRANCHES - part)
        branch = cache.get(f"b{part}", BRANCH)
        if branch is None:
            log(work.folder, f"{work.stem}/b{part}.h5")
            time.sleep(settings.pause)
            branch = bratu(2.0 + 0.1 * settings.number + part)
            cache.put(f"b{part}", branch, BRANCH)
        branches.append(branch)
    log(work.folder, f"{work.stem}.h5")
    with atomic_hdf5(work.path, CHEAP.result.schema) as file:
        import json

        file.attrs["identity"] = json.dumps(settings.identity())
        for part, branch in enumerate(branches):
            write_branch(file.create_group(f"branches/{part}"), branch)
    cache.clear()


def bratu(end):
    """The branch up to the fold and a mean of about `end`."""
    bvp = BVP(
        rhs=lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u)}, boundary=lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
    )  # fmt: skip
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    options = TraceOptions(bounds={"lam": (0.0, min(end, 3.0))}, mesh=MeshControl(tolerance=1e-6))
    return trace(bvp, start, ("lam",), options)


def log(folder, line):
    """Append to the journal at once, as several processes may."""
    with open(folder / JOURNAL, "a", buffering=1) as file:
        file.write(line + "\n")


def journal(folder):
    path = Path(folder) / JOURNAL
    return path.read_text().splitlines() if path.exists() else []


def _first(path):
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def _stem(settings):
    return f"cheap-{settings.number}"


def _contents(file):
    return f"{len(file['branches'])} branches"


def _refused(*_):
    raise NotImplementedError("nobody opens these files, nor makes tables of them")


RESULT = ResultKind("cheap", "rodatlas/test", object, _refused, _contents, _refused)
CHEAP = Kind(RESULT, "cheap", CheapSettings, CheapSettings, _stem, nothing_required, _compute)


def cheap(number, pause=0.0, trouble=""):
    return task_of(CheapSettings(number, pause, trouble), CHEAP)
