"""One process at a time holds a result; claims nest, end with their process, and leave nothing behind."""

import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import pytest

from rodatlas.files import Held, alone_in, claimed, try_claim

HOLD = (
    "import sys, time\nfrom pathlib import Path\nfrom rodatlas.files import claimed\n"
    "with claimed(Path(sys.argv[1])):\n    print('held', flush=True)\n    time.sleep(float(sys.argv[2]))\n"
)


@contextmanager
def holder(path, seconds):
    """Another process that holds a result."""
    command = [sys.executable, "-c", HOLD, str(path), str(seconds)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "held\n"
        yield process


def test_the_second_process_waits_and_says_so(tmp_path):
    path, said = tmp_path / "slice-15.h5", []
    with holder(path, 1.0) as other, claimed(path, said.append):
        assert other.wait(timeout=10) == 0
    assert said == [f"another run is working on slice-15.h5 in {tmp_path}; waiting for it"]
    assert list(tmp_path.iterdir()) == []


def test_a_kill_lets_go(tmp_path):
    path = tmp_path / "r.h5"
    with holder(path, 60.0) as other:
        with try_claim(path) as mine:
            assert not mine
        other.send_signal(signal.SIGKILL)
    with try_claim(path) as mine:
        assert mine
    assert list(tmp_path.iterdir()) == []  # nor what the kill had left


def test_claims_nest_and_others_are_free(tmp_path):
    with claimed(tmp_path / "a"), claimed(tmp_path / "a"), try_claim(tmp_path / "a") as again:
        assert again
        with try_claim(tmp_path / "b") as other:
            assert other
        assert [p.name for p in tmp_path.iterdir()] == [".a.lock"]
    assert list(tmp_path.iterdir()) == []


def test_threads_wait_for_each_other(tmp_path):
    order = []

    def work(name):
        with claimed(tmp_path / "a"):
            order.append(name)
            time.sleep(0.02)
            order.append(name)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert order[::2] == order[1::2]


def test_many_processes_count_without_loss(tmp_path):
    """The lock is removed and made again all the time: no increment may be lost."""
    code = (
        "import sys\nfrom pathlib import Path\nfrom rodatlas.files import claimed\npath = Path(sys.argv[1])\n"
        "for _ in range(200):\n    with claimed(path):\n"
        "        path.write_text(str(int(path.read_text()) + 1))\n"
    )
    path = tmp_path / "count"
    path.write_text("0")
    runs = [subprocess.Popen([sys.executable, "-c", code, str(path)]) for _ in range(4)]
    assert [run.wait(timeout=60) for run in runs] == [0] * 4
    assert path.read_text() == "800"
    assert [p.name for p in tmp_path.iterdir()] == ["count"]


def test_a_folder_that_is_missing_holds_nothing(tmp_path):
    with claimed(tmp_path / "no" / "a"):
        assert not (tmp_path / "no").exists()


def test_a_folder_for_one_coordinator(tmp_path):
    with alone_in(tmp_path), pytest.raises(Held, match="no other study is running in"), alone_in(tmp_path):
        pass
