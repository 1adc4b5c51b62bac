"""What the documentation shows runs: every page from top to bottom, its Python and its commands, in a folder of it.

What takes minutes is made small at the bottom, and all above it is real (`small_results.py`): slices and loci are those
of the session's fixtures or parts of them, whatever their settings; searches have 64 starts; worker processes are
threads. `rodatlas paper` draws one figure; `rodatlas study` lists what the documented file wants, and computes a
smaller one.

Fences: ``python`` is executed, ``output`` is what a command above it has printed, ``toml`` is read, and of those
without a language the lines that begin with rodatlas, make, python or pip are run or checked.
"""

from __future__ import annotations

import ast
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from pkgutil import resolve_name
from typing import NamedTuple

import pytest

import rodatlas
from command_options import COMMANDS, options_of
from rodatlas.atlas.study.studyfile import parse_study
from rodatlas.cli import main

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LONG = [ROOT / "README.md", *(ROOT / f"docs/atlas/{name}.md" for name in
        ("experiments", "models", "phase", "slices", "states", "studies"))]  # fmt: skip
FENCE = re.compile(r"^```(?P<kind>[a-z]*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^(?:rodatlas|make|python|pip) .*$", re.MULTILINE)
INLINE = re.compile(r"`((?:rodatlas|make|python|pip) [^`]+)`")
EXAMPLES = sorted(path.name for path in (ROOT / "examples").glob("*.py"))

BEFORE = {  # what a page takes for granted
    "docs/atlas/experiments.md": (
        "rodatlas slice --angle 15", "rodatlas loci", "rodatlas solve --state U --angle 15 --shear 0 --out u.h5",
        "rodatlas states --angle 30 --shear 0.625 --stable-only --json states.json",
    ),
}  # fmt: skip
FILES = {"ranges.csv": "examples/data/synthetic-ranges-15deg.csv", "study.toml": "examples/studies/compression.toml"}
SMALL_STUDY = 'name = "small"\n[[slices]]\nangle = 15\n[[states]]\nangle = 30\nshear = 0.6\nstable_only = true\n'


class Block(NamedTuple):
    """A fence: its language, what it holds, and on which line it begins."""

    kind: str
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [Block(m["kind"], m["text"], text.count("\n", 0, m.start("text"))) for m in FENCE.finditer(text)]


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def plain(text: str) -> str:
    """Text without the lines of tables, and with single blanks."""
    return " ".join(re.sub(r"[\u2500-\u257f]", " ", text).split())


class Reader:
    """Reads a page: executes its Python, runs its commands, and keeps what they print."""

    def __init__(self, page: Path, capsys: pytest.CaptureFixture[str]):
        self.page, self.capsys = page, capsys
        self.namespace: dict[str, object] = {"__name__": "__main__"}  # worker processes are guarded by it
        self.printed: list[str] = []

    def read(self, block: Block) -> None:
        if block.kind == "python":
            tree = ast.parse(block.text, str(self.page))
            exec(compile(ast.increment_lineno(tree, block.line), str(self.page), "exec"), self.namespace)
        elif block.kind == "output":
            known = [plain(line) for line in self.printed]
            for line in (plain(line) for line in block.text.splitlines() if line.strip(" .")):
                assert line in known, f"{name_of(self.page)}: no command above prints '{line}'"
        elif block.kind == "toml":
            data = tomllib.loads(block.text)
            parse_study(data if set(data) - {"cluster"} else {**data, "slices": [{"angle": 15}]})
        elif block.kind == "":
            for command in COMMAND.findall(block.text):
                self.run(command)

    def run(self, command: str) -> None:
        """A command line as it stands there, but for what :data:`SMALL_STUDY` and the module say."""
        words = shlex.split(command, comments=True)
        if words[0] != "rodatlas":
            check_tool(words)
        elif words[1] == "study":
            self.call([*words, "--dry-run"])
            if "--scheduler" not in words:
                Path("small.toml").write_text(SMALL_STUDY)
                self.call([words[0], words[1], "small.toml", *words[3:]])
        else:
            self.call([*words, "--figure", "slice-15"] if words[1:] == ["paper"] else words)

    def call(self, words: list[str]) -> None:
        with pytest.raises(SystemExit) as leave:
            main(words[1:])
        out, err = self.capsys.readouterr()
        assert not leave.value.code, f"{name_of(self.page)}: {shlex.join(words)}: {err or out}"
        self.printed += out.splitlines()


def check_tool(words: list[str]) -> None:
    """Targets of make, extras of pip, and files of python exist."""
    if words[0] == "make":
        for target in words[1:]:
            assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE), f"make {target}"
    elif words[0] == "pip":
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        for extra in re.findall(r"\[(.*?)\]", " ".join(words)):
            assert extra in project["optional-dependencies"], f"pip: {extra}"
    elif words[1].endswith(".py"):
        assert (ROOT / words[1]).is_file(), words[1]


@pytest.mark.parametrize(
    "page", [pytest.param(p, marks=[pytest.mark.slow] if p in LONG else []) for p in PAGES if blocks(p)], ids=name_of
)
def test_a_page_runs(
    page: Path, tmp_path: Path, small: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for name, source in FILES.items():
        (tmp_path / name).write_text((ROOT / source).read_text(encoding="utf-8"), encoding="utf-8")
    reader = Reader(page, capsys)
    for command in BEFORE.get(name_of(page), ()):
        reader.run(command)
    for block in blocks(page):
        reader.read(block)


def test_what_is_made_small_is_as_it_was_again() -> None:
    for name in ("compute_slice", "compute_loci", "compute_phase", "find_states"):
        assert getattr(rodatlas, name).__name__ == name


def test_nothing_is_left_out() -> None:
    text = {name_of(page): page.read_text(encoding="utf-8") for page in PAGES}
    assert not [name for name, page in text.items() if "not run" in page]
    kinds = {block.kind for page in PAGES for block in blocks(page)}
    assert kinds == {"", "python", "output", "text", "toml", "fortran"}
    commands = {name: sum(len(COMMAND.findall(b.text)) for b in blocks(ROOT / name) if not b.kind) for name in text}
    assert commands["README.md"] > 10
    assert sum(commands.values()) > 30


# -- commands and options in running text ----------------------------------------------------------------------------


def mentioned(page: Path) -> Iterator[list[str]]:
    """Commands in the text of a page, as words; what stands for a name of the user's is in capitals."""
    for command in INLINE.findall(FENCE.sub("", page.read_text(encoding="utf-8"))):
        yield shlex.split(" ".join(command.split()))


def options_of_commands() -> dict[str, set[str]]:
    return {name: {o for p in [*one.params, *options_of(name)] for o in p.opts} for name, one in COMMANDS.items()}


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_in_the_text_exist(page: Path) -> None:
    options = options_of_commands()
    for words in mentioned(page):
        if words[0] != "rodatlas":
            check_tool(words)
            continue
        assert words[1] in options, shlex.join(words)
        assert {w.split("=")[0] for w in words[2:] if w.startswith("--")} <= options[words[1]], shlex.join(words)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_options_files_and_names_in_the_text_exist(page: Path) -> None:
    options = set().union(*options_of_commands().values())
    for code in re.findall(r"`([^`\n]+)`", FENCE.sub("", page.read_text(encoding="utf-8"))):
        if re.fullmatch(r"--[a-z-]+( .*)?", code):
            assert code.split()[0] in options, code
        elif re.fullmatch(r"(src|docs|examples|tests|benchmarks)/[\w./-]*", code):
            assert (ROOT / code).exists(), code
        elif re.fullmatch(r"rodatlas(\.\w+)+(\(.*\))?", code):
            resolve_name(code.partition("(")[0])


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        text = FENCE.sub("", page.read_text(encoding="utf-8"))
        for target in re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", text):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{name_of(page)}: {target}"


# -- the gallery -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_is_in_the_gallery(name: str) -> None:
    """With an entry of its own that includes the file, and a line in the table."""
    gallery = (ROOT / "docs/engine/gallery.md").read_text(encoding="utf-8")
    assert f"## {name}" in gallery
    assert f"```{{literalinclude}} ../../examples/{name}\n" in gallery
    assert f"| [{name}](#" in gallery


def test_the_gallery_includes_no_other_files() -> None:
    gallery = (ROOT / "docs/engine/gallery.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"literalinclude\} \.\./\.\./examples/(\S+)", gallery)) == EXAMPLES
