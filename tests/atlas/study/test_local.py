"""Worker processes: a death costs one call, Ctrl-C does not reach them, and they leave with their parent."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor
from pathlib import Path

import pytest

from rodatlas.atlas.study.local import ONE_THREAD, LocalExecutor

HELPERS = Path(__file__).parent


def environment_of(names):
    return {name: os.environ.get(name) for name in names}


def gone(pid, seconds=10.0):
    """Whether a process ends within some seconds; one that is dead but not yet collected counts."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.05)
    return False


def test_a_death_costs_one_call_and_nothing_else():
    with LocalExecutor(2) as executor:
        slow, lost = executor.submit(time.sleep, 1.5), executor.submit(os._exit, 9)
        with pytest.raises(RuntimeError, match="all 2 workers are busy"):
            executor.submit(os.getpid)
        with pytest.raises(BrokenExecutor):
            lost.result(timeout=60)
        assert not slow.done()
        assert executor.submit(sum, (1, 2)).result(timeout=60) == 3  # in a new process
        assert slow.result(timeout=60) is None


def test_workers_have_one_thread_and_the_parent_keeps_its_environment():
    before = dict(os.environ)
    with LocalExecutor(1) as executor:
        assert executor.submit(environment_of, ONE_THREAD).result(timeout=60) == ONE_THREAD
    assert dict(os.environ) == before


def test_ctrl_c_does_not_reach_workers_and_close_ends_them():
    with LocalExecutor(1) as executor:
        pid = executor.submit(os.getpid).result(timeout=60)
        os.kill(pid, signal.SIGINT)
        assert executor.submit(os.getpid).result(timeout=60) == pid
        executor.submit(time.sleep, 600)
        begin = time.monotonic()
    assert time.monotonic() - begin < 60  # not waited for
    assert gone(pid)


def test_workers_leave_when_their_parent_is_killed():
    code = (
        "import os, time\nfrom rodatlas.atlas.study.local import LocalExecutor\n"
        "if __name__ == '__main__':\n"
        "    executor = LocalExecutor(1)\n"
        "    print(executor.submit(os.getpid).result(), flush=True)\n"
        "    executor.submit(time.sleep, 600).result()\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    worker = int(parent.stdout.readline())
    assert not gone(worker, 0.2)
    parent.kill()
    parent.communicate()
    assert gone(worker)


def test_a_number_of_workers_below_one_is_refused():
    with pytest.raises(ValueError, match="workers: expected a number of at least 1, got 0"):
        LocalExecutor(0)
