"""Study files: combinations, grids, and errors that name the place of each wrong value."""

import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest

from rodatlas.atlas.study import StatesSettings, Study
from rodatlas.atlas.study.cluster_settings import ClusterSettings
from rodatlas.atlas.study.kinds import KINDS
from rodatlas.atlas.study.studyfile import parse_study
from rodatlas.paper.model import band, band_loci, band_slice

EXAMPLES = sorted((Path(__file__).parents[3] / "examples/studies").glob("*.toml"))


@pytest.fixture
def read(tmp_path):
    def read_text(text):
        path = tmp_path / "study.toml"
        path.write_text(text)
        return Study.load(path)

    return read_text


def test_lists_and_grids_are_combined(read):
    study = read(
        "[[slices]]\nangle = [0, 15, 30]\ncompression = {from = 0.3, to = 0.7, count = 5}\n"
        "[[slices]]\nangle = 15\nshear_max = 0.5\npoisson = {from = 0, to = 0.3, step = 0.1}\n"
        '[[states]]\nangle = 30\nshear = 0.625\nclasses = ["+", "-"]\nstable_only = true\n'
    )
    assert study.name == "study"
    settings = [t.settings for t in study.tasks]
    assert len(settings) == 3 * 5 + 4 + 2
    places = {(s.setting["angle"], s.setting["compression"]) for s in settings[:15]}
    assert places == {(a, c) for a in (0.0, 15.0, 30.0) for c in (0.3, 0.4, 0.5, 0.6, 0.7)}  # no 0.6000000000000001
    default = next(s for s in settings[:15] if s == band_slice(15.0))
    assert (default.high, default.low) == (0.82, -0.05)
    shorter = next(s for s in settings[:15] if s.setting["compression"] == 0.3)
    assert shorter.high == pytest.approx(0.82 * (1 - 0.7**2) ** 0.5 / 0.75**0.5)  # of the limiting shear
    assert [s.setting["poisson"] for s in settings[15:19]] == [0.0, 0.1, 0.2, 0.3]
    assert settings[19:] == [
        StatesSettings(30.0, 0.625, classes=c, stable_only=True) for c in ("+", "-")
    ]  # fmt: skip


def test_the_same_result_is_wanted_once(read):
    study = read(
        "[[slices]]\nangle = [15, 15.0]\n[[slices]]\nangle = 15\ncompression = 0.5\n[[loci]]\nangle_max = 50\n"
    )
    assert [t.kind.name for t in study.tasks] == ["slice", "loci"]
    assert study.tasks[1].settings == band_loci(angle_max=50.0)


def test_a_cluster_is_read(read):
    study = read(
        'retries = 4\n[[slices]]\nangle = 1\n[cluster]\nkind = "slurm"\njobs = 3\ncores = 8\nmemory = "16GB"\n'
        'walltime = "1-12:00:00"\nqueue = "long"\ndirectives = ["--exclusive"]\n'
    )
    wanted = ClusterSettings("slurm", 3, 8, "16GB", "1-12:00:00", "long", directives=("--exclusive",))
    assert (study.retries, study.cluster) == (4, wanted)


@pytest.mark.parametrize(
    ("field", "value", "what"),
    [
        ("kind", "pbs", "'slurm', got 'pbs'"), ("jobs", 0, "a whole number from 1 to 10000, got 0"),
        ("cores", 2000, "a whole number from 1 to 1024, got 2000"),
        ("walltime", "long", "a time such as 01:00:00, got 'long'"),
        ("walltime", "01:00:00\n", "a time such as 01:00:00, got '01:00:00"),
    ],
)  # fmt: skip
def test_settings_of_a_cluster_are_checked_wherever_they_come_from(field, value, what):
    """In Python and in a file: by the same code, so in the same words."""
    wrong = {"kind": "slurm", field: value}
    with pytest.raises(ValueError, match=rf"^{field}: expected ") as told:
        ClusterSettings(**wrong)
    with pytest.raises(ValueError, match=r"^study: cluster\.") as read:
        parse_study({"slices": [{"angle": 15}], "cluster": wrong})
    assert str(told.value).startswith(f"{field}: expected {what}")
    assert str(read.value) == f"study: cluster.{told.value}"


def test_a_cluster_has_the_names_of_its_settings():
    with pytest.raises(
        ValueError, match=r"^study: cluster\.nodes: expected one of kind, jobs, .*, scratch, got another"
    ):
        parse_study({"slices": [{"angle": 15}], "cluster": {"kind": "slurm", "nodes": 2}})
    with pytest.raises(ValueError, match=r"^study: cluster\.kind: expected a value, got none$"):
        parse_study({"slices": [{"angle": 15}], "cluster": {}})
    with pytest.raises(ValueError, match=r"^study: cluster\.jobs: expected a whole number, got True$"):
        parse_study({"slices": [{"angle": 15}], "cluster": {"kind": "slurm", "jobs": True}})


@pytest.mark.parametrize(
    ("section", "name"),
    [(kind.section, name) for kind in KINDS for name, (plain, _) in kind.parameters(band()).items() if plain is float],
)
def test_an_error_names_the_value_that_is_wrong(section, name):
    """By its name in the file, for every number of every kind of table."""
    table = {"angle": 15.0, "shear": 0.1} if section == "states" else {"angle": 15.0} if section == "slices" else {}
    with pytest.raises(ValueError, match=rf"^study: {section}\[0\]\.{name}: expected"):
        parse_study({section: [table | {name: -1e9}]})


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[[slices]]\nangle = 'x'", "study.toml: slices[0].angle: expected a number, a list of numbers or a grid "
                                    "{from, to, count}, got 'x'"),
        ("[[slices]]\nangle = [15, 'x']", "study.toml: slices[0].angle[1]: expected a number"),
        ("[[slices]]\nangle = []", "study.toml: slices[0].angle: expected at least one value, got []"),
        ("[[slices]]\nangle = true", "study.toml: slices[0].angle: expected a number"),
        ("[[slices]]\nangle = nan", "study.toml: slices[0].angle: expected a finite number, got nan"),
        ("[[slices]]\nangle = 95", "study.toml: slices[0].angle: expected degrees with 0 <= angle < 90, got 95.0"),
        ("[[slices]]\nangle = 1\n[[slices]]\nangle = 2\ntolerance = 1", "study.toml: slices[1].tolerance: expected a"),
        ("[[slices]]\nangle = 1\nshear_max = 2", "study.toml: slices[0].shear_max: expected a number of size below"),
        ("[[slices]]\ncompression = 0.5", "study.toml: slices[0].angle: expected a value, got none"),
        ("[[slices]]\nangle = 1\nangel = 15", "study.toml: slices[0].angel: expected one of model, along, against,"),
        ("[[slyces]]\nangle = 15", "study.toml: slyces: expected one of name, retries, cluster, slices,"),
        ("[slices]\nangle = 15", "study.toml: slices: expected tables in double brackets"),
        ("[[slices]]\nangle = {from = 0, to = 9}", "study.toml: slices[0].angle: expected either count or step"),
        ("[[slices]]\nangle = {from = 0, to = 9, count = 1}", "study.toml: slices[0].angle.count: expected a num"),
        ("[[slices]]\nangle = {from = 0, to = 9, step = 2}", "study.toml: slices[0].angle: expected a step that"),
        ("[[slices]]\nangle = {from = 9, to = 0, step = 1}", "study.toml: slices[0].angle: expected a range that"),
        ("[[slices]]\nangle = {from = 0, to = 9, by = 2}", "study.toml: slices[0].angle.by: expected one of from, to"),
        ("[[states]]\nangle = 1\nshear = 0\nstarts = 1.5", "study.toml: states[0].starts: expected a whole number"),
        ("[[states]]\nangle = 1\nshear = 0\nclasses = 'x'", "study.toml: states[0].classes: expected +, - or both"),
        ("[[states]]\nangle = 1\nshear = 0\nstable_only = 1", "study.toml: states[0].stable_only: expected true or"),
        ("retries = -1\n[[slices]]\nangle = 1", "study.toml: retries: expected a number of at least 0, got -1"),
        ("[[slices]]\nangle = 1\n[cluster]\nkind = 'pbs'", "study.toml: cluster.kind: expected 'slurm', got 'pbs'"),
        ("[[slices]]\nangle = 1\n[cluster]\nkind = 'slurm'\nwalltime = 'long'", "study.toml: cluster.walltime: expect"),
        ("name = 'nothing'", "study.toml: expected at least one table of [[slices]]"),
        ("[[slices]\n", "study.toml: expected TOML, got something else: "),
        ("[[slices]]\nangle = {from=0, to=80, count=90000}\npoisson=[0, 0.1]", "study.toml: slices[0]: expected at mo"),
    ],
)  # fmt: skip
def test_errors_name_the_place(read, text, error):
    with pytest.raises(ValueError, match=r"^study\.toml: ") as caught:
        read(text)
    assert str(caught.value).startswith(error)
    assert "\n" not in str(caught.value)


def test_every_error_is_reported(read):
    with pytest.raises(ValueError, match=r"^study") as caught:
        read("[[slices]]\nangle = ['a', 1, 'b']\ncompression = 'c'\n[[states]]\nangle = 1")
    text = str(caught.value)
    for place in ("slices[0].angle[0]", "slices[0].angle[2]", "slices[0].compression", "states[0].shear"):
        assert f"study.toml: {place}: expected" in text
    with pytest.raises(ValueError, match=r"^study") as caught:
        read("[[slices]]\nangle = [95, 15, 99]\n[[slices]]\nangle = 1\npoisson = 0.7")
    assert str(caught.value).count("expected degrees") == 2
    assert "study.toml: slices[1].poisson: expected a number with -1 < nu <= 0.5, got 0.7" in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"study: expected a file that can be read, got '.*none\.toml' \(No such file"):
        Study.load(tmp_path / "none.toml")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.name)
def test_examples_are_right(path):
    assert len(Study.load(path).tasks) >= 4


@pytest.mark.parametrize("name", ["studies.md", "cluster.md"])
def test_what_the_pages_show_is_right(name):
    page = (Path(__file__).parents[3] / "docs/atlas" / name).read_text(encoding="utf-8")
    (text,) = re.findall(r"^```toml\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    study = parse_study({"slices": [{"angle": 15}]} | tomllib.loads(text), name)
    if name == "studies.md":
        kinds = Counter(t.kind.name for t in study.tasks)
        assert (kinds["states"], kinds["loci"]) == (5, 3)
        assert kinds["slice"] == 15 + 3 - 1 + 3 * 3 - 1  # with those on which the loci start
    else:
        assert study.cluster == ClusterSettings(
            "slurm", 4, 8, "16GB", "02:00:00", "normal", "project", "ib0", ("--constraint=skylake",),
            ("module load python/3.11",), "/local/scratch",
        )  # fmt: skip


def test_there_are_examples():
    assert len(EXAMPLES) >= 3
