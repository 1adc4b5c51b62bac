"""A real Dask scheduler and two worker processes on this machine: killing one loses no task.

All traffic is on 127.0.0.1.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cheap import cheap, journal
from test_local import gone
from test_study import content, statuses

from rodatlas.atlas.study import Study, run_study

HERE = Path(__file__).parent
SETTINGS = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}  # workers that one task may take with it
pytest.importorskip("distributed", reason="needs the package distributed: pip install 'rodatlas[cluster]'")


class Cluster:
    """A scheduler and workers as separate processes."""

    def __init__(self, folder):
        self._folder, self._processes = folder, []
        path = folder / "scheduler.json"
        self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(path))
        self.address = self._read(path)

    def worker(self):
        """Start a worker without a nanny, which would start it again."""
        local = self._folder / "scratch"
        return self._start(
            "worker", self.address, "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--no-dashboard",
            "--local-directory", str(local),
        )  # fmt: skip

    def wait(self):
        """Until the first worker is there."""
        from distributed import Client

        with Client(self.address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)

    def _start(self, which, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{which}", *arguments]
        paths = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
        with open(self._folder / "log.txt", "a") as log:
            environment = os.environ | {"PYTHONPATH": paths, **SETTINGS}
            process = subprocess.Popen(command, env=environment, stdout=log, stderr=log, cwd=self._folder)
        self._processes.append(process)
        return process

    def _read(self, path):
        end = time.monotonic() + 60
        while time.monotonic() < end:
            try:
                return json.loads(path.read_text())["address"]
            except (OSError, ValueError):
                time.sleep(0.05)
        raise AssertionError((self._folder / "log.txt").read_text())

    def kill_scheduler(self):
        self._processes[0].kill()
        self._processes[0].wait()

    def close(self):
        for process in self._processes:
            process.kill()
            process.wait()


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    found = Cluster(tmp_path_factory.mktemp("dask"))
    yield found
    found.close()


@pytest.mark.slow
def test_a_killed_worker_loses_no_task(cluster, tmp_path):
    first, second = cluster.worker(), cluster.worker()
    study = Study("dask", tuple(cheap(i, pause=0.1) for i in range(12)))
    victim, at_kill = [], []

    def kill_one(event):
        """While both are at work; the first who is heard of dies."""
        if event.kind == "working" and not victim:
            notes = [json.loads(p.read_text()) for p in (tmp_path / ".progress").glob("*.json")]
            pids = {int(n["worker"].rpartition(":")[2]) for n in notes}
            if pids == {first.pid, second.pid}:
                victim.append(first)
                first.kill()
                first.wait()
                at_kill.extend(journal(tmp_path))

    result = run_study(study, tmp_path, scheduler=cluster.address, listen=kill_one)
    assert victim
    assert gone(first.pid)
    assert not result.failed
    lines = journal(tmp_path)
    twice = {line for line in lines if lines.count(line) > 1}
    assert len(twice) <= 1  # the branch at which the worker died
    assert {line for line in lines if line.endswith(".h5") and "/" not in line} >= {t.file for t in study.tasks}
    again = run_study(study, tmp_path, scheduler=cluster.address)
    assert set(statuses(again).values()) == {"reused"}
    plain = run_study(Study("plain", study.tasks[:2]), tmp_path / "plain", workers=1)
    for o in plain.outcomes:
        assert content(tmp_path / o.task.file) == content(tmp_path / "plain" / o.task.file)


@pytest.mark.slow
def test_a_task_that_takes_its_workers_with_it_is_given_up(cluster, tmp_path):
    """And not those that waited on the same workers, which Dask gives up too. It takes two; the third does the rest."""
    for _ in range(3):
        cluster.worker()
    study = Study("dask", (cheap(0, trouble="dies"), *map(cheap, range(1, 7))))
    result = run_study(study, tmp_path, scheduler=cluster.address)
    assert statuses(result) == {0: "failed", **dict.fromkeys(range(1, 7), "done")}
    assert "KilledWorker" in result.outcomes[0].error
    assert result.outcomes[0].attempts == 1  # Dask has started it twice


def test_workers_that_see_another_folder_are_named(cluster, tmp_path, monkeypatch):
    """As if the folder here were not that of the same name there: the mark in it is not the one of this run."""
    cluster.worker()
    cluster.wait()
    monkeypatch.setattr("rodatlas.atlas.study.run.write_plan", lambda folder, study: "a run that nobody knows")
    with pytest.raises(ValueError, match=r"scheduler: expected workers that can do this study, got: worker .*:\d+ does "
                                         r"not see the folder .* of the study .* all workers share"):  # fmt: skip
        run_study(Study("dask", (cheap(0),)), tmp_path, scheduler=cluster.address)


def test_a_scheduler_that_is_not_there_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("rodatlas.atlas.study.cluster.TIMEOUT", 0.5)
    with pytest.raises(ValueError, match=r"scheduler: expected one that answers, got 'tcp://127\.0\.0\.1:9'") as caught:
        run_study(Study("dask", (cheap(0),)), tmp_path, scheduler="tcp://127.0.0.1:9")
    assert "\n" not in str(caught.value)


def test_without_dask_the_message_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ValueError, match=r"scheduler: expected the package distributed, got none; pip inst"):
        run_study(Study("dask", (cheap(0),)), tmp_path, scheduler="tcp://127.0.0.1:9")


@pytest.mark.slow
def test_a_scheduler_that_dies_ends_the_study_and_keeps_what_is_finished(tmp_path):
    own = Cluster(tmp_path)
    try:
        own.worker()
        study = Study("dask", tuple(cheap(i, pause=0.1) for i in range(4)))

        def kill(event):
            if event.kind == "done":
                own.kill_scheduler()

        result = run_study(study, tmp_path / "out", scheduler=own.address, listen=kill)
    finally:
        own.close()
    done = [o for o in result.outcomes if o.good]
    assert 1 <= len(done) < 4
    assert {o.error for o in result.failed} == {
        f"no worker takes tasks: ConnectionError: the scheduler at {own.address} does not answer"
    }
    again = run_study(study, tmp_path / "out", workers=1)
    assert [o.status.value for o in again.outcomes].count("reused") >= len(done)
    assert not again.failed


def test_a_worker_that_goes_while_it_is_asked_is_left_out(tmp_path):
    """Dask hands back the broken connection in place of an answer: it says nothing about the worker's folder."""
    from rodatlas.atlas.study.cluster import _check_workers

    class Client:
        def run(self, *arguments, **keywords):
            return {"tcp://127.0.0.1:1": "", "tcp://127.0.0.1:2": ConnectionResetError("stream closed")}

        def scheduler_info(self):
            return {"address": "tcp://127.0.0.1:9"}

    told = []
    _check_workers(Client(), tmp_path, "run", told.append)
    assert told == ["1 workers at tcp://127.0.0.1:9"]
