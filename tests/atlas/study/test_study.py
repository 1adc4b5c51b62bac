"""A study computes what is missing, reports what fails, and never takes a damaged or foreign file for a result."""

import json
import os
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import pytest
from cheap import CHEAP, CheapSettings, cheap, journal

from rodatlas.atlas.study import Study, list_folder, run_study
from rodatlas.atlas.study.kinds import kind_of
from rodatlas.atlas.study.local import LocalExecutor
from rodatlas.atlas.study.task import Task, task_of
from rodatlas.paper.model import band_loci, band_slice


@pytest.fixture
def threads():
    """An executor with `submit` and nothing else: tasks run in this process."""
    with ThreadPoolExecutor(1) as pool:
        yield pool


def statuses(result):
    return {o.task.settings.number: o.status.value for o in result.outcomes}


@pytest.mark.slow
def test_failures_are_retried_within_a_cap_and_cost_nothing_else(tmp_path):
    """With two processes: one task never works, one takes its worker with it always, others only the first time."""
    trouble = {1: "dies once", 2: "always", 3: "dies", 4: "fails once"}
    study = Study("trouble", tuple(cheap(i, trouble=trouble.get(i, "")) for i in range(6)), retries=1)
    events = []
    result = run_study(study, tmp_path, workers=2, listen=events.append)
    assert statuses(result) == {0: "done", 1: "done", 2: "failed", 3: "failed", 4: "done", 5: "done"}
    assert {o.task.settings.number: o.attempts for o in result.outcomes} == {0: 1, 1: 2, 2: 2, 3: 2, 4: 2, 5: 1}
    errors = {o.task.settings.number: o.error for o in result.failed}
    assert errors[2] == "RuntimeError: this never works"
    assert errors[3] == "the worker process died (killed, out of memory, or crashed)"
    assert sum(e.kind == "retry" for e in events) == 4
    lines = journal(tmp_path)
    assert len(lines) == len(set(lines)) == 4 * 4  # each branch and each result of four tasks once
    # the reasons are kept beside the results, with a traceback, and listed
    (text,) = tmp_path.glob("cheap-2-*.error.txt")
    assert "raise RuntimeError" in text.read_text()
    listed = {e.file: (e.status, e.detail) for e in list_folder(tmp_path).entries}
    assert listed[result.outcomes[2].task.file] == ("failed", "RuntimeError: this never works")
    # again: only what failed is tried
    again = run_study(study, tmp_path, workers=1)
    assert statuses(again) == {0: "reused", 1: "reused", 2: "failed", 3: "failed", 4: "reused", 5: "reused"}
    assert journal(tmp_path) == lines


def test_damaged_and_foreign_files_are_renamed_and_computed_again(tmp_path, threads):
    study = Study("damage", tuple(map(cheap, range(4))))
    first = run_study(study, tmp_path, executor=threads)
    paths = [first.path(o.task.settings) for o in first.outcomes]
    good = [content(p) for p in paths]
    paths[0].write_bytes(paths[0].read_bytes()[:-1000])  # truncated
    flip(paths[1])
    with h5py.File(paths[2], "r+") as file:  # as if another version had computed it
        file.attrs["identity"] = file.attrs["identity"].replace('"rodatlas": "', '"rodatlas": "9.')
    notes = []
    lines = journal(tmp_path)
    again = run_study(study, tmp_path, executor=threads, listen=lambda e: notes.append(e.message))
    assert statuses(again) == {0: "done", 1: "done", 2: "done", 3: "reused"}
    said = [n for n in notes if "computed again" in n]
    assert len(said) == 3
    assert "is damaged" in said[0]
    assert "is damaged" in said[1]
    assert "for other settings or by another version" in said[2]
    assert [content(p) for p in paths] == good
    assert sum(line.startswith("cheap-3") for line in journal(tmp_path)[len(lines) :]) == 0
    assert len(list(tmp_path.glob("*.damaged"))) == 3  # nothing is thrown away


def content(path):
    """All numbers of a file, byte by byte."""
    found = {}
    with h5py.File(path, "r") as file:
        file.visititems(lambda n, x: found.update({n: x[()].tobytes()}) if isinstance(x, h5py.Dataset) else None)
    return found


def flip(path):
    """Change one byte in the middle of the numbers of a file, keeping its size."""
    with h5py.File(path, "r") as file:
        offset = file["branches/1/points/solutions/stages"].id.get_chunk_info(0).byte_offset
    data = bytearray(path.read_bytes())
    data[offset + 40] ^= 0xFF
    path.write_bytes(data)


def test_a_damaged_branch_of_an_unfinished_task_is_computed_again(tmp_path, threads):
    task = cheap(0)
    folder = tmp_path / task.stem
    run_study(Study("s", (task,)), tmp_path, executor=threads)
    reference = content(tmp_path / task.file)
    (tmp_path / task.file).unlink()
    # as a kill would leave it: two branches finished, one of them cut by a dying disk, and a file half written
    from rodatlas.atlas.cache import BRANCH, FolderCache

    cache = FolderCache(folder, task.settings)
    from cheap import bratu

    for part in (0, 1):
        cache.put(f"b{part}", bratu(2.0 + part), BRANCH)
    (folder / "b1.h5").write_bytes((folder / "b1.h5").read_bytes()[:3000])
    (folder / ".b2.h5.0123456789ab.partial").write_bytes(b"half")
    notes, lines = [], journal(tmp_path)
    run_study(Study("s", (task,)), tmp_path, executor=threads, listen=lambda e: notes.append((e.kind, e.message)))
    assert next(m for kind, m in notes if kind == "note").startswith(f"{task.stem}/b1.h5 is damaged")
    assert journal(tmp_path)[len(lines) :] == [f"{task.stem}/b1.h5", f"{task.stem}/b2.h5", task.file]
    assert content(tmp_path / task.file) == reference
    assert not folder.exists()


def test_changed_settings_never_share_a_file():
    base = band_slice(15.0)
    others = [
        band_slice(15.0, tolerance=1e-7), band_slice(15.0, shear_max=0.8), band_slice(15.0, shear_min=0.0),
        band_slice(15.0, poisson=0.250001), band_slice(15.0, 0.500001), band_slice(15.000001),
    ]  # fmt: skip
    stems = {task_of(s).stem for s in [base, *others]}
    assert len(stems) == 1 + len(others)
    assert task_of(band_slice(15)).stem == task_of(base).stem


def test_another_version_has_other_files(monkeypatch):
    before = task_of(band_slice(15.0)).stem
    monkeypatch.setattr("rodatlas.atlas.slices.settings.__version__", "9.9.9")
    assert task_of(band_slice(15.0)).stem != before


def test_what_requires_a_failed_task_is_skipped_and_says_so(tmp_path, threads):
    bad = cheap(0, trouble="always")
    after = Task(CHEAP, CheapSettings(1), "after", (bad.stem,))
    last = Task(CHEAP, CheapSettings(2), "last", ("after",))
    result = run_study(Study("chain", (bad, after, last, cheap(3)), retries=0), tmp_path, executor=threads)
    assert statuses(result) == {0: "failed", 1: "skipped", 2: "skipped", 3: "done"}
    assert result.outcomes[1].error == f"requires {bad.stem}, which failed"


def test_required_tasks_run_first(tmp_path):
    first = cheap(0, pause=0.2)
    after = Task(CHEAP, CheapSettings(1), "after", (first.stem,))
    result = run_study(Study("chain", (first, after)), tmp_path, workers=2)
    assert all(o.good for o in result.outcomes)
    lines = journal(tmp_path)
    assert lines.index(first.file) < lines.index("after/b0.h5")


def test_loci_require_their_slices():
    study = Study.of("loci", [band_loci(angle_max=57.0), band_slice(15.0, shear_max=0.82)])
    kinds = [t.kind.name for t in study.tasks]
    assert kinds == ["slice", "slice", "loci"]  # at 15 and 55 degrees, each once; 60 is outside
    assert set(study.tasks[-1].requires) == {t.stem for t in study.tasks[:2]}
    assert kind_of(band_loci()).name == "loci"


def test_a_full_disk_stops_the_study_in_one_line_and_costs_nothing_finished(tmp_path, threads):
    study = Study("full", (cheap(0), cheap(1, trouble="full disk"), cheap(2)), retries=1)
    result = run_study(study, tmp_path, executor=threads)
    # all three were handed over at once here, so the third one ran too
    assert statuses(result)[0] == "done"
    assert result.outcomes[1].error == "OSError: [Errno 28] No space left on device"
    with LocalExecutor(1) as one:
        again = run_study(study, tmp_path, executor=one)
    assert statuses(again)[0] == "reused"
    more = Study("full", (cheap(1, trouble="full disk"), cheap(5), cheap(6)), retries=0)
    with LocalExecutor(1) as one:
        result = run_study(more, tmp_path, executor=one)
    assert statuses(result) == {1: "failed", 5: "skipped", 6: "skipped"}
    assert result.outcomes[1].error.startswith("no space left in ")


SMALL_DISK = 600_000  # bytes: two results of cheap tasks and a half


@pytest.fixture
def small_disk(tmp_path):
    """A file system of its own that is nearly full from the start."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SMALL_DISK}", "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small file system can be mounted by root only, and not in every container")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.slow
def test_a_disk_that_is_really_full(small_disk, tmp_path):
    study = Study("full", tuple(map(cheap, range(6))), retries=1)
    with LocalExecutor(1) as one:
        result = run_study(study, small_disk, executor=one)
    counts = [o.status.value for o in result.outcomes]
    assert counts.count("failed") == 1
    assert set(counts[: counts.index("failed")]) == {"done"}
    assert set(counts[counts.index("failed") + 1 :]) == {"skipped"}
    assert "No space left" in result.failed[0].error or "errno = 28" in result.failed[0].error
    for o in result.outcomes:
        if o.good:
            assert list_folder(small_disk, thorough=True).count("damaged") == 0
    # with room again, the rest follows
    subprocess.run(["mount", "-o", "remount,size=10m", str(small_disk)], check=True)
    with LocalExecutor(1) as one:
        again = run_study(study, small_disk, executor=one)
    assert not again.failed
    assert [o.status.value for o in again.outcomes].count("reused") == counts.count("done")


def test_only_one_study_at_a_time_in_a_folder(tmp_path):
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom rodatlas.files import alone_in\n"
        f"with alone_in(Path({str(tmp_path)!r})):\n    print('held', flush=True)\n    time.sleep(600)\n"
    )
    holder = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert holder.stdout.readline() == "held\n"
    with pytest.raises(ValueError, match="out: expected a folder that no other study is running in"):
        run_study(Study("s", (cheap(0),)), tmp_path, workers=1)
    holder.kill()  # and the folder is free at once
    holder.communicate()
    assert not run_study(Study("s", ()), tmp_path, workers=1).failed


def test_the_catalogue_is_made_again_from_the_files(tmp_path, threads):
    run_study(Study("s", tuple(map(cheap, range(3)))), tmp_path, executor=threads)
    path = tmp_path / "catalogue.sqlite"
    with sqlite3.connect(path) as connection:
        rows = connection.execute("SELECT * FROM results ORDER BY file").fetchall()
    connection.close()
    assert len(rows) == 3
    for spoil in (path.unlink, lambda: path.write_bytes(b"no database"), lambda: path.write_bytes(b"")):
        spoil()
        before = list_folder(tmp_path)
        assert before.count("complete") == 3
        with sqlite3.connect(path) as connection:
            assert connection.execute("SELECT * FROM results ORDER BY file").fetchall() == rows
        connection.close()


def test_a_study_goes_on_with_a_damaged_catalogue(tmp_path, threads):
    run_study(Study("s", (cheap(0),)), tmp_path, executor=threads)
    (tmp_path / "catalogue.sqlite").write_bytes(b"SQLite format 3\0" + b"damage" * 500)
    result = run_study(Study("s", (cheap(0), cheap(1))), tmp_path, executor=threads)
    assert statuses(result) == {0: "reused", 1: "done"}
    assert len(list_folder(tmp_path).entries) == 2


def test_results_as_tables_and_json(tmp_path, threads):
    result = run_study(Study("s", (cheap(0), cheap(1, trouble="always")), retries=0), tmp_path, executor=threads)
    assert repr(result).startswith("StudyResult('s': 1 done, 1 failed; ")
    frame = result.to_frame()
    assert list(frame["status"]) == ["done", "failed"]
    assert list(frame["number"]) == [0, 1]
    data = json.loads(json.dumps(result.to_json()))
    assert data["schema"] == "rodatlas/study/1"
    assert data["tasks"][1]["error"] == "RuntimeError: this never works"
    with pytest.raises(KeyError, match="is no task of the study 's'"):
        result.path(CheapSettings(7))
    assert Path(data["folder"]) == tmp_path


def test_settings_without_a_kind_are_refused():
    with pytest.raises(ValueError, match="settings: expected one of SliceSettings, StatesSettings, LociSettings"):
        Study.of("s", [CheapSettings(0)])


def test_a_listing_is_in_order_of_the_numbers_in_names(tmp_path):
    names = ["loci.h5", "slice-5.h5", "slice-27.5.h5", "slice-30.h5", "slice-100.h5"]
    for name in names:
        (tmp_path / name).write_bytes(b"no result")
    assert [entry.file for entry in list_folder(tmp_path).entries] == names
