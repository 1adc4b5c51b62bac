"""What a `[cluster]` table of a study file says: its names, their defaults, and what each may be."""

from __future__ import annotations

import re
from dataclasses import dataclass

from rodatlas.continuation.checks import WrongInput, check_each, check_number, check_type, check_whole, shown

KINDS = ("slurm",)
MOST_JOBS, MOST_CORES = 10_000, 1024  # against slips of the pen
TIME = re.compile(r"(\d+-)?\d+(:\d\d){0,2}")


@dataclass(frozen=True)
class ClusterSettings:
    """Jobs of a batch system that run workers.

    Attributes
    ----------
    kind : of the batch system: 'slurm'.
    jobs : number of jobs to ask for.
    cores : workers of one job, each a process with one thread.
    memory : of one job, '4GB' say.
    walltime : of one job, '01:00:00' say; a job that ends takes at most the branches in work with it.
    queue : partition, the default one when empty.
    account : to be charged, the default one when empty.
    interface : network interface of the nodes, 'ib0' say; the usual one when empty.
    directives : further lines for the job's head, '--constraint=skylake' say.
    prologue : shell lines to be run before the worker starts.
    scratch : folder of a node for the worker's own files.

    Raises
    ------
    ValueError
        naming the field, what was expected and what came.
    """

    kind: str
    jobs: int = 1
    cores: int = 1
    memory: str = "2GB"
    walltime: str = "01:00:00"
    queue: str = ""
    account: str = ""
    interface: str = ""
    directives: tuple[str, ...] = ()
    prologue: tuple[str, ...] = ()
    scratch: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise WrongInput("kind", f"expected {' or '.join(map(repr, KINDS))}, got {shown(self.kind)}")
        for field, most in (("jobs", MOST_JOBS), ("cores", MOST_CORES)):
            what = f"a whole number from 1 to {most}"
            check_number(field, check_whole(field, getattr(self, field), 1, what), 1, most, what)
        for field in ("memory", "walltime", "queue", "account", "interface", "scratch"):
            check_type(field, getattr(self, field), str, "a text")
        if TIME.fullmatch(self.walltime) is None:
            raise WrongInput("walltime", f"expected a time such as 01:00:00, got {shown(self.walltime)}")
        for field in ("directives", "prologue"):
            check_each(field, getattr(self, field), str, "a sequence of texts")
