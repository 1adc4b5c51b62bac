"""Whatever else has the name of a result is kept, with `fresh` too; what others have in work is left to them."""

import errno
import subprocess
import sys
from pathlib import Path

import pytest

from rodatlas.atlas import Slice
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.atlas.phase.obtain import obtain_phase
from rodatlas.atlas.slices.obtain import obtain_slice, stored_slice
from rodatlas.atlas.study import Study, list_folder, run_study
from rodatlas.files import Held, alone_in, try_claim
from rodatlas.paper.model import band_loci, band_phase, band_slice

ONE = band_slice(15.0, search=0)
PATH = f"{ONE.stem}.h5"


class Stop(RuntimeError):
    """Where a computation would begin."""


@pytest.fixture
def cheap(monkeypatch):
    """Slices without branches, at once; each has another time by which it is known."""
    made = []

    def compute(settings, *_, **__):
        made.append(settings)
        return Slice(settings, (), (), (), float(len(made)))

    monkeypatch.setattr("rodatlas.atlas.slices.obtain.compute_slice", compute)
    return made


def test_fresh_keeps_what_is_another_result(tmp_path, cheap):
    """The slice of other settings that was saved under the name, and a damaged file; only its own result goes."""
    path, said = tmp_path / PATH, []
    Slice(ONE.at(angle=30.0), (), (), (), 99.0).save(path)
    other = path.read_bytes()
    assert obtain_slice(ONE, tmp_path, fresh=True, say=said.append).seconds == 1.0
    assert (tmp_path / f"{PATH}.other").read_bytes() == other
    assert f"it is kept as {PATH}.other" in said[0]
    path.write_bytes(path.read_bytes()[:-100])
    assert obtain_slice(ONE, tmp_path, fresh=True).seconds == 2.0
    assert obtain_slice(ONE, tmp_path, fresh=True).seconds == 3.0
    assert sorted(p.name for p in tmp_path.iterdir()) == [PATH, f"{PATH}.damaged", f"{PATH}.other"]


@pytest.mark.parametrize(("obtain", "settings", "begins"), [
    (obtain_loci, band_loci(), "rodatlas.atlas.loci.obtain.compute_loci"),
    (obtain_phase, band_phase(), "rodatlas.atlas.phase.obtain.obtain_slices"),
])  # fmt: skip
def test_fresh_keeps_what_is_no_such_result(tmp_path, monkeypatch, obtain, settings, begins):
    def stop(*_, **__):
        raise Stop

    monkeypatch.setattr(begins, stop)
    path = tmp_path / ("loci.h5" if obtain is obtain_loci else "phase.h5")
    path.write_bytes(b"mine")
    with pytest.raises(Stop):
        obtain(settings, tmp_path, fresh=True)
    assert (tmp_path / f"{path.name}.damaged").read_bytes() == b"mine"


def test_a_folder_that_is_not_there_yet_is_locked_too(tmp_path, monkeypatch):
    """Two programs that start with a new folder compute a slice once."""
    held = []

    def compute(settings, *_, **__):
        code = (
            "import sys\nfrom pathlib import Path\nfrom rodatlas.files import try_claim\n"
            "with try_claim(Path(sys.argv[1])) as mine:\n    print(mine)\n"
        )
        command = [sys.executable, "-c", code, str(tmp_path / "new" / PATH)]
        held.append(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        return Slice(settings, (), (), (), 1.0)

    monkeypatch.setattr("rodatlas.atlas.slices.obtain.compute_slice", compute)
    obtain_slice(ONE, tmp_path / "new")
    assert held == ["False\n"]
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"folder: expected one that can be made, got '.*new' \(Not a directory"):
        obtain_slice(ONE, tmp_path / "file" / "new")


@pytest.mark.parametrize("gone", ["stored_slice", "obtain_slice"])
def test_a_file_that_is_taken_away_while_it_is_opened_is_missing(tmp_path, cheap, monkeypatch, gone):
    obtain_slice(ONE, tmp_path)
    exists = Path.exists

    def vanish(path, **options):
        there = exists(path, **options)
        if path.name == PATH:
            path.unlink(missing_ok=True)
        return there

    monkeypatch.setattr(Path, "exists", vanish)
    if gone == "stored_slice":
        assert stored_slice(tmp_path, ONE) is None
    else:
        assert obtain_slice(ONE, tmp_path).seconds == 2.0


def test_show_does_not_mind_what_runs_finish_meanwhile(tmp_path, cheap, monkeypatch):
    """A result is renamed, and a folder of branches removed, after the folder was listed."""
    obtain_slice(ONE, tmp_path)
    work = tmp_path / "slice-30"
    work.mkdir()
    (work / "settings.json").write_text("{}")
    (work / "U.h5").write_text("")
    stat = Path.stat

    def vanish(path, **options):
        if path.suffix == ".h5":
            raise FileNotFoundError(errno.ENOENT, "No such file or directory", str(path))
        return stat(path, **options)

    assert len(list_folder(tmp_path).entries) == 2
    monkeypatch.setattr(Path, "stat", vanish)
    assert list_folder(tmp_path).entries == ()


def test_a_study_leaves_alone_what_other_runs_are_writing(tmp_path):
    """A slice, and an export, in the folder of a study that begins meanwhile."""
    task = Study.of("s", [ONE]).tasks[0]
    written = tmp_path / ".slice-30.h5.0123456789ab.partial"
    written.write_bytes(b"half")
    exported = tmp_path / ".shape.a1_b2c3d.partial"
    exported.mkdir()
    own = tmp_path / f".{task.file}.0123456789ab.partial"
    own.write_bytes(b"left by a kill")
    run_study(Study("s", ()), tmp_path)
    assert written.exists()
    assert exported.exists()

    class Nobody:
        def submit(self, *_):
            raise Stop

    run_study(Study("s", (task,)), tmp_path, executor=Nobody())
    assert written.exists()
    assert exported.exists()


def test_a_study_waits_for_the_moment_in_which_its_folder_is_looked_at(tmp_path, monkeypatch):
    """`rodatlas show` holds it while it writes the catalogue; where there are no locks, nobody is kept out."""
    monkeypatch.setattr("rodatlas.files.claim.PATIENCE", 5.0)
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom rodatlas.files import alone_in\n"
        "with alone_in(Path(sys.argv[1])):\n    print('held', flush=True)\n    time.sleep(0.3)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout.readline() == "held\n"
        with alone_in(tmp_path):
            pass
    monkeypatch.setattr("rodatlas.files.claim.PATIENCE", 0.0)
    with alone_in(tmp_path), pytest.raises(Held), alone_in(tmp_path):
        pass

    def no_locks(descriptor, wait):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("rodatlas.files.claim._lock", no_locks)
    with alone_in(tmp_path), alone_in(tmp_path), try_claim(tmp_path / "a") as mine:
        assert mine
