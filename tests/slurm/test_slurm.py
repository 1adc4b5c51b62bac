"""A study in jobs of a real SLURM, one of which is cancelled: every result is there, and is what one process gives.

Runs where `sinfo` shows a node that takes jobs; `single_node.sh` makes such a one from Debian packages.
"""

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from rodatlas.atlas import Slice, compute_slice
from rodatlas.atlas.study import Study, run_study
from rodatlas.atlas.study.cluster_settings import ClusterSettings
from rodatlas.paper.model import band_slice

NEAR = band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)


def why_not():
    """Why these tests cannot run here; empty when they can."""
    hint = "tests/slurm/single_node.sh start FOLDER makes one"
    if shutil.which("sbatch") is None:
        return f"needs SLURM, and there is no sbatch here; {hint}"
    nodes = subprocess.run(["sinfo", "--noheader", "--format=%t"], capture_output=True, text=True, check=False)
    if nodes.returncode != 0 or not {"idle", "mix", "alloc"} & set(nodes.stdout.split()):
        return f"needs a SLURM with a node that takes jobs, and sinfo shows none; {hint}"
    try:
        import dask_jobqueue  # noqa: F401
    except ImportError:
        return "needs the package dask-jobqueue: pip install 'rodatlas[cluster]'"
    return ""


REASON = why_not()


def jobs():
    """Numbers of this user's running jobs."""
    command = ["squeue", "--me", "--noheader", "--states=running", "--format=%i"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.skipif(bool(REASON), reason=REASON or "-")
def test_a_cancelled_job_loses_no_result(tmp_path):
    # on a real cluster: a folder that all nodes see, and their network
    folder = Path(os.environ.get("RODATLAS_SHARED", tmp_path)) / "study"
    interface = os.environ.get("RODATLAS_INTERFACE", "lo")
    cluster = ClusterSettings("slurm", jobs=2, memory="1500MB", walltime="00:10:00", interface=interface)
    wanted = [replace(NEAR, poisson=nu) for nu in (0.1, 0.15, 0.2, 0.25, 0.3, 0.35)]
    study = replace(Study.of("slurm", wanted), cluster=cluster)
    before, cancelled = jobs(), []

    def cancel_one(event):
        """While the second task is at work."""
        mine = [job for job in jobs() if job not in before] if event.kind == "working" and not cancelled else []
        if len(mine) == 2:
            subprocess.run(["scancel", mine[0]], check=True)
            cancelled.append(mine[0])

    result = run_study(study, folder, listen=cancel_one)
    assert cancelled
    assert [(o.status.value, o.error) for o in result.outcomes] == [("done", "")] * len(wanted)
    assert not (set(jobs()) - set(before))  # the jobs end with the study
    found = Slice.load(result.path(NEAR)).to_json()
    assert {**found, "seconds": 0} == {**compute_slice(NEAR).to_json(), "seconds": 0}
