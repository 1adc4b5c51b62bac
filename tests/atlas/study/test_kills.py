"""Random kills of a study lose nothing that is finished, and the results are those of an undisturbed run."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cheap import cheap, journal
from test_local import gone
from test_study import content

from rodatlas.atlas import Slice
from rodatlas.atlas.study import LocalExecutor, Study, list_folder, run_study
from rodatlas.atlas.study.integrity import read_everything

KILLS, TASKS, PAUSE = 12, 24, 0.1
RUN = Path(__file__).with_name("study_process.py")


def start(folder, log):
    """The study in a process group of its own."""
    arguments = [sys.executable, str(RUN), str(folder), str(TASKS), str(PAUSE)]
    return subprocess.Popen(arguments, start_new_session=True, stdout=subprocess.DEVNULL, stderr=log)


def finished(folder):
    """Result and branch files that are there, with their times."""
    names = [*folder.glob("cheap-*.h5"), *folder.glob("cheap-*/*.h5")]
    found = {}
    for path in names:
        try:
            found[str(path.relative_to(folder))] = path.stat().st_mtime_ns
        except FileNotFoundError:  # removed meanwhile, since its task is complete
            continue
    return found


def workers_of(pid):
    """Processes that a process has started."""
    path = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in path.read_text().split()] if path.exists() else []


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds processes through /proc, which is not there")
def test_random_kills_lose_nothing_finished(tmp_path):
    rng = random.Random(20)
    folder = tmp_path / "study"
    there, lines = {}, 0  # result and branch files at the last kill, and the length of the journal then
    with open(tmp_path / "log.txt", "w") as log:
        for kill in range(KILLS):
            running = start(folder, log)
            _wait_for_work(running, folder, lines)
            time.sleep(rng.uniform(0.0, 0.35))
            assert running.poll() is None, "expected a study that lasts longer than the kills"
            children = workers_of(running.pid)
            if kill % 2:  # all at once, or the coordinator alone, whose workers then leave
                os.killpg(running.pid, signal.SIGKILL)
            else:
                running.kill()
            running.communicate()
            assert all(gone(pid) for pid in children)
            _expect_kept(folder, there, lines)
            there, lines = finished(folder), len(journal(folder))
            for name in there:
                assert read_everything(folder / name) == ""
    study = Study("kills", tuple(cheap(i, PAUSE) for i in range(TASKS)))
    assert not run_study(study, folder, workers=2).failed
    _expect_kept(folder, there, lines)
    _compare_with_undisturbed(study, folder, tmp_path / "undisturbed")


def _expect_kept(folder, there, lines):
    """Nothing that was there at the last kill has been begun again since, and results are as they were."""
    assert not set(there) & set(journal(folder)[lines:])
    now = finished(folder)
    assert all(now.get(name) == at for name, at in there.items() if "/" not in name)
    for name in (n for n in there if "/" in n and n not in now):
        assert f"{name.partition('/')[0]}.h5" in now  # a branch goes only when its task is complete


def _wait_for_work(running, folder, before):
    """Until a new line stands in the journal, or the study is over."""
    while running.poll() is None and len(journal(folder)) == before:
        time.sleep(0.01)


def _compare_with_undisturbed(study, folder, reference):
    with LocalExecutor(2) as pool:
        run_study(Study("plain", study.tasks), reference, executor=pool)
    for task in study.tasks:
        assert content(folder / task.file) == content(reference / task.file)
    left = {p.name for p in folder.iterdir() if not p.name.startswith(".")}
    assert left == {t.file for t in study.tasks} | {"journal.txt", "study.json", "catalogue.sqlite"}
    assert not list(folder.glob(".*.partial"))
    assert list_folder(folder, thorough=True).count("complete") == TASKS


@pytest.mark.slow
def test_a_slice_that_was_killed_resumes_with_its_finished_branches(tmp_path, near_zero):
    """A real slice: after a kill in the middle, its finished branches are used and the numbers are the same."""
    settings = near_zero.settings
    study = Study.of("slice", [settings, settings.at(poisson=0.3)])
    code = (
        "from rodatlas.atlas.study import Study, run_study\nfrom rodatlas.paper.model import band_slice\n"
        "if __name__ == '__main__':\n"
        "    s = band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0)\n"
        f"    run_study(Study.of('slice', [s, s.at(poisson=0.3)]), {str(tmp_path)!r}, workers=1)\n"
    )
    running = subprocess.Popen([sys.executable, "-c", code], start_new_session=True)
    folder = tmp_path / study.tasks[0].stem
    while running.poll() is None and len(list(folder.glob("*.h5"))) < 3:
        time.sleep(0.01)
    os.killpg(running.pid, signal.SIGKILL)
    running.communicate()
    kept = {p: p.stat().st_mtime_ns for p in folder.glob("*.h5")}
    assert len(kept) >= 3
    assert [e.status for e in list_folder(tmp_path).entries][:1] == ["partial"]
    times = {}

    def watch(event):
        times.update({p: p.stat().st_mtime_ns for p in kept if p.exists()})

    result = run_study(study, tmp_path, workers=1, listen=watch)
    assert not result.failed
    assert times == kept  # never written again
    found = Slice.load(result.path(settings)).to_json()
    assert {**found, "seconds": 0} == {**near_zero.to_json(), "seconds": 0}
