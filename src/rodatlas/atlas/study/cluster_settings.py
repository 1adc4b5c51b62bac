"""What a `[cluster]` table of a study file says."""

from __future__ import annotations

from dataclasses import dataclass

KINDS = ("slurm",)


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
