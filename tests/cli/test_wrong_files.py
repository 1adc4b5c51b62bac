"""Wrong study files, tables and data files: one line on stderr, exit code 2, nothing written, no work begun."""

from __future__ import annotations

import importlib
import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from rodatlas.atlas import Slice, SliceBranch
from rodatlas.atlas.slices.branches.frontier import Followed
from rodatlas.cli import main
from rodatlas.continuation import BVP, Solution, TraceOptions, trace
from rodatlas.paper.model import band_phase, band_slice
from small_results import straight_phase

SLICES = "[[slices]]\nangle = 15\n"
STUDIES = {
    "empty": "", "no TOML": "hello", "not closed": "[[slices", "twice": f"{SLICES}angle = 20\n",
    "one table": "[slices]\nangle = 15\n", "list of numbers": "slices = [1, 2]\n", "number": "slices = 3\n",
    "name only": "name = 'x'\n", "name is a number": f"name = 3\n{SLICES}", "unknown key": f"nmae = 'x'\n{SLICES}",
    "unknown table": "[[slyces]]\nangle = 15\n", "unknown option": f"{SLICES}angel = 3\n",
    "no angle": "[[slices]]\npoisson = 0.25\n", "no shear": "[[states]]\nangle = 15\n",
    "deep": f"x = {'[' * 5000}{']' * 5000}\n", "deep tables": f"x = {'{a = ' * 3000}1{'}' * 3000}\n",
    "deep keys": f"{'a.' * 5000}a = 1\n", "huge integer": f"[[slices]]\nangle = {'9' * 400}\n",
    "longer integer": f"[[slices]]\nangle = {'9' * 5000}\n", "retries": f"retries = -1\n{SLICES}",
    "many retries": f"retries = 1000\n{SLICES}", "retries is true": f"retries = true\n{SLICES}",
    "grid without end": "[[slices]]\nangle = {from = 1}\n",
    "both": "[[slices]]\nangle = {from=1, to=2, count=2, step=1}\n",
    "neither": "[[slices]]\nangle = {from = 1, to = 2}\n",
    "grid of one": "[[slices]]\nangle = {from=1, to=2, count=1}\n",
    "huge grid": "[[slices]]\nangle = {from = 1, to = 2, count = 1000000000}\n",
    "fine grid": "[[slices]]\nangle = {from = 1, to = 2, step = 1e-300}\n",
    "step of nothing": "[[slices]]\nangle = {from = 1, to = 2, step = 0}\n",
    "step back": "[[slices]]\nangle = {from = 2, to = 1, step = 0.5}\n",
    "step beside": "[[slices]]\nangle = {from = 1, to = 2, step = 0.3}\n",
    "grid to inf": "[[slices]]\nangle = {from = 1, to = inf, count = 3}\n",
    "grid of grids": "[[slices]]\nangle = {from = {from = 1}, to = 2, count = 2}\n",
    "unknown grid": "[[slices]]\nangle = {start = 1, stop = 2, num = 3}\n", "empty list": "[[slices]]\nangle = []\n",
    "list in list": "[[slices]]\nangle = [[15]]\n", "mixed list": "[[slices]]\nangle = [15, 'x']\n",
    "product": "[[slices]]\nangle = {from=1, to=2, count=1000}\npoisson = {from=0.1, to=0.2, count=1000}\n",
    "zip": "[[slices]]\nangle = [15, 20, {from = 1, to = 2, count = 2}]\n",
    "class": "[[states]]\nangle = 15\nshear = 0\nclasses = 'x'\n",
    "number of starts": "[[states]]\nangle = 15\nshear = 0\nstarts = 1.5\n",
    "starts": "[[states]]\nangle = 15\nshear = 0\nstarts = 1000000000000\n",
    "text for flag": "[[states]]\nangle = 15\nshear = 0\nstable_only = 'yes'\n",
    "beyond the limit": "[[states]]\nangle = 15\nshear = 0.9\n",
    "seed": "[[states]]\nangle = 15\nshear = 0\nseed = -1\n",
    "low loci": "[[loci]]\nangle_max = 10\n", "phase": "[[phases]]\nangle_min = 50\nangle_max = 40\n",
    "cluster": f"{SLICES}[cluster]\nkind = 'lsf'\n", "cluster jobs": f"{SLICES}[cluster]\nkind = 'slurm'\njobs = 0\n",
    "cluster time": f"{SLICES}[cluster]\nkind = 'slurm'\nwalltime = 'long'\n",
    "cluster key": f"{SLICES}[cluster]\nkind = 'slurm'\npartition = 'x'\n",
    "cluster list": f"{SLICES}[[cluster]]\nkind = 'slurm'\n",
    "many jobs": f"{SLICES}[cluster]\nkind = 'slurm'\njobs = 1000000000\n",
    "control character": '[[slices]]\nangle = "\x01"\n',
}  # fmt: skip
VALUES = ["'x'", "''", "true", "nan", "inf", "-inf", "1e400", "1e300", "-1e300", "1979-05-27", "{}", "['15']", "[true]"]
for _key in ("angle", "compression", "poisson", "tolerance", "shear_max", "shear_min", "search"):
    for _value in VALUES:
        _rest = "" if _key == "angle" else "angle = 15\n"
        STUDIES[f"{_key} = {_value}"] = f"[[slices]]\n{_rest}{_key} = {_value}\n"
STUDIES |= {f"bytes {i}": text for i, text in enumerate((b"\xff\xfe\x00", b"\x00" * 50, b"name = '\xe9'\n"))}

HEAD = "state,shear_min,shear_max"
TABLES = {
    "empty": "", "comments": "# nothing\n", "header": f"{HEAD}\n", "other header": "a,b,c\nU,0,1\n",
    "twice": f"{HEAD},state\nU,0,1,U\n", "missing": "state,shear_min\nU,0\n", "short row": f"{HEAD}\nU,0\n",
    "long row": f"{HEAD}\nU,0,0.1,3\n", "tabs": "state\tshear_min\tshear_max\nU\t0\t1\n",
    "semicolons": "state;shear_min\nU;0\n",
    "no state": f"{HEAD}\n,0,0.1\n", "other state": f"{HEAD}\nQ,0,0.1\n", "no number": f"{HEAD}\nU,x,0.1\n",
    "nan": f"{HEAD}\nU,nan,0.1\n", "inf": f"{HEAD}\nU,0,inf\n", "underscore": f"{HEAD}\nU,0,0_1\n",
    "other digits": f"{HEAD}\nU,0,１\n", "empty number": f"{HEAD}\nU,,0.1\n", "backwards": f"{HEAD}\nU,0.2,0.1\n",
    "beyond": f"{HEAD}\nU,0,5\n", "unit": f"{HEAD},unit\nU,0,0.1,furlong\n", "mm": f"{HEAD},unit\nU,0,10,mm\n",
    "error": f"{HEAD},error\nU,0,0.1,-1\n",
    "no error": f"{HEAD},error\nU,0,0.1,x\n",
    "band": f"{HEAD},band\nU,0,0.1,240x3\n", "wide band": f"{HEAD},band\nU,0,0.1,240x500x0.1\n",
    "width": f"{HEAD},width\nU,0,0.1,1/0\n", "wide": f"{HEAD},width\nU,0,0.1,30\n",
    "width in mm": f"{HEAD},width\nU,0,0.1,3 mm\n",
    "thick": f"{HEAD},band,width\nU,0,0.1,240x3x0.127,0.01 mm\n",
    "quotes": f'{HEAD}\n"U,0,0.1\n', "null": f"{HEAD}\nU,0,\0\n",
    "huge field": f"{HEAD}\nU,0,{'9' * 200_000}\n",
    "UTF-16": f"{HEAD}\nU,0,0.1\n".encode("utf-16"), "binary": bytes(range(256)),
}  # fmt: skip

STATE = {"name": "U", "class": "+", "energy": 7.8, "N0": [-17.0, 10.0, 0.0], "M0": [0.0, 0.0, 0.1]}
SETTING = {"angle": 15.0, "compression": 0.5, "shear": 0.1, "offset": 0.0, "twist": 0.0, "poisson": 0.25}
LISTED = {"schema": "rodatlas/states/1", "setting": SETTING, "states": [STATE]}
OBJECTS = {
    "empty": "", "no JSON": "{", "number": "1", "list": "[]", "null": "null", "text": '"x"', "nothing": "{}",
    "schema": LISTED | {"schema": "rodatlas/slice/1"}, "schema number": LISTED | {"schema": 1},
    "states": LISTED | {"states": 3}, "states object": LISTED | {"states": {}}, "state": LISTED | {"states": [1]},
    "state null": LISTED | {"states": [None]}, "state list": LISTED | {"states": [[]]},
    "state empty": LISTED | {"states": [{}]},
    "deep": "[" * 100_000, "deep states": json.dumps(LISTED).replace("[-17.0", "[" * 9000 + "-17.0"),
}  # fmt: skip
OBJECTS |= {f"without {key}": {k: v for k, v in LISTED.items() if k != key} for key in LISTED}
OBJECTS |= {f"setting {wrong}": LISTED | {"setting": wrong} for wrong in (None, 3, [], {}, "x")}
OBJECTS |= {f"setting with {key}": LISTED | {"setting": SETTING | {key: 1.0}} for key in ("angle_left", "x")}
NAN = float("nan")
for _wrong in (None, "x", True, NAN, float("inf"), 1e300, [], {}, [1.0], ["x"] * 3, [None] * 3, [NAN] * 3):
    for _key in ("N0", "M0", "energy"):
        OBJECTS[f"{_key} {_wrong}"] = LISTED | {"states": [STATE | {_key: _wrong}]}
    for _key in SETTING:
        OBJECTS[f"{_key} {_wrong}"] = LISTED | {"setting": SETTING | {_key: _wrong}}
OBJECTS |= {"binary": b"\xff\xfe\x00", "UTF-16": json.dumps(LISTED).encode("utf-16")}


@pytest.fixture
def refused(capsys, tmp_path, monkeypatch):
    """Runs a wrong command line in a folder and gives its line."""
    monkeypatch.chdir(tmp_path)

    def work(*_: object, **__: object) -> None:
        raise AssertionError("work has begun")

    for module, name in (
        ("slices.obtain", "compute_slice"),
        ("study.run", "LocalExecutor"),
        ("study.run", "write_plan"),
    ):
        monkeypatch.setattr(importlib.import_module(f"rodatlas.atlas.{module}"), name, work)

    def refuse(*arguments: str) -> str:
        before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
        with pytest.raises(SystemExit) as stop:
            main(list(arguments))
        out, err = capsys.readouterr()
        assert (stop.value.code, out) == (2, ""), err
        assert err.startswith("rodatlas: ")
        assert len(err.splitlines()) == 1
        assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
        return err

    return refuse


def put(path: Path, content: str | bytes | object) -> None:
    """Write bytes, a text, or an object as JSON."""
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")


@pytest.mark.parametrize("name", STUDIES)
def test_a_wrong_study_file(refused, tmp_path, name):
    put(tmp_path / "wrong.toml", STUDIES[name])
    line = refused("study", "wrong.toml", "--out", "new")
    assert line.startswith("rodatlas: wrong.toml: ")
    assert ": expected " in line
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", TABLES)
def test_a_wrong_table_of_measurements(refused, tmp_path, name):
    put(tmp_path / "wrong.csv", TABLES[name])
    line = refused("slice", "--angle", "15", "--overlay", "wrong.csv", "--out", "new")
    assert "wrong.csv" in line
    assert "expected " in line
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", OBJECTS)
@pytest.mark.parametrize("form", ["csv", "vtp"])
def test_a_wrong_table_of_states(refused, tmp_path, name, form):
    put(tmp_path / "wrong.json", OBJECTS[name])
    line = refused("export", "wrong.json", "--out", f"new/x.{form}")
    assert "wrong.json" in line
    assert ": expected " in line
    assert not (tmp_path / "new").exists()


# -- HDF5 -------------------------------------------------------------------------------------------------------------


def bratu() -> BVP:
    return BVP(
        rhs=lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u)}, boundary=lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
    )  # fmt: skip


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """Right files: a solution, a branch with a fold, a slice that holds a branch."""
    folder = tmp_path_factory.mktemp("right")
    bvp = bratu()
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    branch = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (0.0, 4.0)}, max_points=12))
    branch.points[0].solution.save(folder / "solution.h5")
    branch.save(folder / "branch.h5")
    bare = trace(bvp, start, ("lam",), TraceOptions(bounds={"lam": (0.0, 1.0)}))
    slice_ = Slice(band_slice(15.0), (SliceBranch(Followed("U", bare, frozenset(), False), ()),), (), (), 0.0)
    slice_.save(folder / "slice.h5")
    straight_phase(band_phase()).save(folder / "phase.h5")
    return folder


KINDS = ("solution", "branch", "slice", "phase")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("part", [0.0, 0.01, 0.1, 0.5, 0.9, 0.999])
def test_a_file_that_was_cut_off(refused, right, tmp_path, kind, part):
    content = (right / f"{kind}.h5").read_bytes()
    (tmp_path / "wrong.h5").write_bytes(content[: int(part * len(content))])
    assert "wrong.h5: expected" in refused("export", "wrong.h5", "--out", "new/x.csv")


@pytest.mark.parametrize("content", [b"hello", b"\x89HDF\r\n\x1a\n" + b"\0" * 500, bytes(range(256)) * 9])
def test_a_file_that_is_no_hdf5(refused, tmp_path, content):
    (tmp_path / "wrong.h5").write_bytes(content)
    assert "wrong.h5: expected" in refused("export", "wrong.h5", "--out", "new/x.csv")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("name", "value"),
    [("schema", "rodatlas/other"), ("schema", 3), ("schema", None), ("version", 99), ("version", "x"),
     ("version", None), ("version", 1.5)],
)  # fmt: skip
def test_a_file_with_another_head(refused, right, tmp_path, kind, name, value):
    shutil.copy(right / f"{kind}.h5", tmp_path / "wrong.h5")
    with h5py.File(tmp_path / "wrong.h5", "a") as file:
        del file.attrs[name]
        if value is not None:
            file.attrs[name] = value
    assert "wrong.h5: expected" in refused("export", "wrong.h5", "--out", "new/x.csv")


def broken(source: Path, target: Path) -> list[tuple[str, Path]]:
    """Copies of a file, each with one item removed, of another shape or type, or NaN."""
    items: list[tuple[str, str | None]] = []
    with h5py.File(source) as file:
        items += [("/", key) for key in file.attrs]
        file.visititems(lambda name, item: items.extend([(name, None), *((name, key) for key in item.attrs)]))
    copies = []
    for number, (name, key) in enumerate(items):
        for change in ("removed", ("number", "text", "nan")[number % 3]):
            path = target / f"wrong-{number}-{change}.h5"
            shutil.copy(source, path)
            with h5py.File(path, "a") as file:
                if _changed(file, name, key, change):
                    copies.append((f"{name} {key} {change}", path))
    return copies


def _changed(file: h5py.File, name: str, key: str | None, change: str) -> bool:
    """Change one item of a file; whether there was anything to change."""
    value = {"number": 7, "text": "x"}.get(change)
    if key is not None:
        if change == "nan":
            return False
        del file[name].attrs[key]
        if value is not None:
            file[name].attrs[key] = value
        return True
    old = file[name]
    if change == "nan":
        if not isinstance(old, h5py.Dataset) or old.dtype.kind != "f" or old.size == 0:
            return False
        value = np.full(old.shape, np.nan)
    del file[name]
    if value is not None:
        file[name] = value
    return True


@pytest.mark.parametrize("kind", KINDS)
def test_no_change_inside_a_file_is_a_fault_of_the_program(capsys, right, tmp_path, monkeypatch, kind):
    """Some changes are of what is not read; whatever is noticed is one line that names the file."""
    monkeypatch.chdir(tmp_path)
    noticed = 0
    for what, path in broken(right / f"{kind}.h5", tmp_path):
        with pytest.raises(SystemExit) as stop:
            main(["export", path.name, "--out", "x.csv", "--overwrite"])
        _, err = capsys.readouterr()
        assert stop.value.code in (0, 2), f"{what}: {err}"
        if stop.value.code == 2:
            noticed += 1
            assert err.startswith("rodatlas: "), what
            assert f"{path.name}: expected" in err, f"{what}: {err}"
            assert len(err.splitlines()) == 1, what
        else:
            assert err == "", what
    assert noticed >= 20


@pytest.mark.parametrize("name", ["mesh", "values", "stages", "parameters"])
def test_what_is_no_number_is_noticed(refused, right, tmp_path, name):
    shutil.copy(right / "solution.h5", tmp_path / "wrong.h5")
    with h5py.File(tmp_path / "wrong.h5", "a") as file:
        assert _changed(file, name, None, "nan")
    assert f"/{name} holds what is no finite number" in refused("export", "wrong.h5", "--out", "new/x.csv")


def test_a_folder_with_damaged_files_is_listed(capsys, right, tmp_path):
    """`show` tells what is wrong with each, and is right itself."""
    for kind in KINDS:
        shutil.copy(right / f"{kind}.h5", tmp_path / f"{kind}.h5")
    (tmp_path / "out").mkdir()
    for _, path in broken(right / "slice.h5", tmp_path / "out")[::20]:
        path.rename(tmp_path / path.name)
    for number, name in enumerate(list(OBJECTS)[::4]):
        put(tmp_path / f"{number}.json", OBJECTS[name])
    (tmp_path / "work").mkdir()
    for content in ("[" * 100_000, "[]", '{"tasks": 3}', '{"tasks": [{"file": 1}]}', b"\xff"):
        put(tmp_path / "study.json", content)
        put(tmp_path / "work/settings.json", content)
        for check in ([], ["--check"])[: 1 + (content == b"\xff")]:
            with pytest.raises(SystemExit) as stop:
                main(["show", str(tmp_path), "--json", "-", *check])
            out, err = capsys.readouterr()
            assert stop.value.code == 0, err
            listed = {r["file"]: r["status"] for r in json.loads(out)["results"]}
            assert {f"{kind}.h5" for kind in KINDS} <= {name for name, status in listed.items() if status == "complete"}
