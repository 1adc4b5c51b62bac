"""What the documentation shows runs, and every example is in the gallery."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"(?P<mark><!-- not run -->\s*)?^```python\n(?P<code>.*?)^```$", re.DOTALL | re.MULTILINE)
EXAMPLES = sorted(path.name for path in (ROOT / "examples").glob("*.py"))


def blocks(page: Path) -> list[tuple[ast.Module, bool]]:
    """The Python blocks of a page, parsed with their line numbers, and whether each is to be run."""
    text, found = page.read_text(encoding="utf-8"), []
    for match in BLOCK.finditer(text):
        code = match["code"]
        tree = ast.parse(code, str(page))
        ast.increment_lineno(tree, text.count("\n", 0, match.start("code")))
        found.append((tree, match["mark"] is None))
    return found


def only_imports(tree: ast.Module) -> ast.Module:
    """What is left to check of a block that is not run: the names that it imports exist."""
    return ast.Module([node for node in tree.body if isinstance(node, ast.Import | ast.ImportFrom)], [])


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p)], ids=lambda p: p.relative_to(ROOT).as_posix())
def test_python_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    namespace: dict[str, object] = {"__name__": "documentation"}
    for tree, run in blocks(page):
        exec(compile(tree if run else only_imports(tree), str(page), "exec"), namespace)


def test_pages_with_code_are_found() -> None:
    names = {p.relative_to(ROOT).as_posix() for p in PAGES if blocks(p)}
    assert {"README.md", "docs/index.md", "docs/engine/from-auto.md", "docs/engine/events.md"} <= names


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
