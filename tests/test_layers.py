"""The layers of the package: imports run down the list only, and heavy libraries are loaded when needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import rodatlas

ROOT = Path(rodatlas.__file__).parent
BASE = ("files", "progress", "failures")  # import nothing of the package, are imported by any layer
LAYERS = (  # top to bottom
    "cli", "explorer", "paper", "atlas", "states", "snap", "plot", "rods", "model", "continuation", *BASE,
)  # fmt: skip
INSIDE = {  # folders and modules of a package, the same; and what loads something above it when it is called
    "atlas/slices": (
        ("reach", "close_up", "obtain", "compute", "store", "states", "result", "branches", "settings"),
        {"result": ("store", "states")},
    ),
    "atlas": (
        ("contents", "study", "open", "results", "phase", "loci", "slices", "stored", "cache", "unfinished"),
        {"phase": ("study",)},  # a plane is sampled by many slices
    ),
    "plot": (("exports", "branches", "planes", "shapes", "slices", "band", "look"), {}),
}
ENGINE = ("locus", "curve", "singular", "symmetric", "store", "results", "discrete", "problem", "linear")  # the same
# `branch.plot()` loads its figure when it is called, as `branch.save()` loads the store: one call for a user of the
# engine, whose modules know nothing of figures otherwise
DRAWN_BY = {"rodatlas.plot.branches": ("results",)}
SAVED_BY = {"store": ("results", "discrete")}  # `result.save()` loads the store when it is called
HEAVY = ("numba", "casadi", "matplotlib", "scipy", "numpy", "h5py", "pandas")


def modules() -> list[Path]:
    return sorted(ROOT.rglob("*.py"))


def imported(path: Path) -> set[str]:
    """Every module of the package that a file imports, inside functions and for type checkers too."""
    package = ["rodatlas", *path.relative_to(ROOT).with_suffix("").parts]
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                base = ".".join([*package[: len(package) - node.level], *([node.module] if node.module else [])])
            found |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
    return {name for name in found if name.split(".")[0] == "rodatlas"}


def layer(parts: list[str]) -> str | None:
    """The layer of a module given by its dotted name's parts; None for the package itself."""
    return parts[1] if len(parts) > 1 and parts[1] in LAYERS else None


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_run_down_the_list(path: Path) -> None:
    inside = path.relative_to(ROOT).with_suffix("").parts
    mine = layer(["rodatlas", *inside])
    for name in imported(path):
        other = layer(name.split("."))
        if mine is None:  # the face names what it loads when asked, see the tests of it below
            assert other is None or inside in (("__main__",), ("__init__",)), f"the package itself imports {name}"
        elif other is None:
            assert name in ("rodatlas", "rodatlas.__version__"), f"{mine} imports {name} from the face, above all"
        else:
            drawn = mine == "continuation" and any(
                name.startswith(figure) and inside[1] in rooms for figure, rooms in DRAWN_BY.items()
            )
            assert drawn or LAYERS.index(other) >= LAYERS.index(mine), f"{mine} imports {name}, which is above it"


def test_every_folder_is_a_known_layer() -> None:
    folders = {p.name for p in ROOT.iterdir() if p.is_dir() and any(p.rglob("*.py"))}
    assert folders <= set(LAYERS)


@pytest.mark.parametrize("package", INSIDE)
def test_imports_run_down_inside_packages(package: str) -> None:
    """From folder to folder, and from a module beside them; what stands in no list is below all."""
    order, lazily = INSIDE[package]
    dotted = f"rodatlas.{package.replace('/', '.')}."
    for path in sorted((ROOT / package).rglob("*.py")):
        room = path.relative_to(ROOT / package).parts[0].removesuffix(".py")
        if room not in order:
            continue  # the face, or what stands below all
        for name in imported(path):
            other = name.removeprefix(dotted).split(".")[0] if name.startswith(dotted) else ""
            if other in order and other not in lazily.get(room, ()):
                assert order.index(other) >= order.index(room), f"{package}: {room} imports {name}, which is above it"


@pytest.mark.parametrize("package", INSIDE)
def test_every_folder_inside_has_a_place_in_the_order(package: str) -> None:
    folders = {p.name for p in (ROOT / package).iterdir() if p.is_dir() and any(p.glob("*.py"))}
    assert folders - {"experiments"} <= set(INSIDE[package][0])


def engine_modules() -> list[Path]:
    return [path for path in modules() if path.relative_to(ROOT).parts[0] == "continuation"]


@pytest.mark.parametrize("path", engine_modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_run_down_the_folders_of_the_engine(path: Path) -> None:
    room = path.relative_to(ROOT).parts[1]
    if room == "__init__.py":
        return  # the face
    below = ENGINE[ENGINE.index(room) :] if room in ENGINE else ()
    for name in imported(path):
        other = name.split(".")[2] if name.startswith("rodatlas.continuation.") else None
        if other in ENGINE and room not in SAVED_BY.get(other, ()):
            assert other in below, f"{room} imports {name}, which is above it"


def test_results_load_store_and_figures_only_when_asked() -> None:
    code = (
        "import sys, rodatlas.continuation\n"
        "names = ('continuation.store', 'rodatlas.plot', 'h5py', 'matplotlib')\n"
        "print([m for m in sys.modules if any(name in m for name in names)])"
    )
    assert _python(code) == "[]"


def test_every_folder_of_the_engine_has_a_place_in_the_order() -> None:
    folders = {p.name for p in (ROOT / "continuation").iterdir() if p.is_dir() and any(p.rglob("*.py"))}
    assert folders == set(ENGINE)


def test_the_engine_runs_without_the_rest() -> None:
    code = (
        "import sys, rodatlas.continuation\n"
        "print([m for m in sys.modules if m.startswith('rodatlas.') and not m.startswith('rodatlas.continuation')])"
    )
    assert _python(code) == "['rodatlas.failures']"


def test_importing_the_package_loads_nothing_heavy() -> None:
    loaded = f"[m for m in sys.modules if m in {HEAVY} or m.startswith('rodatlas.')]"
    assert _python(f"import sys, rodatlas; dir(rodatlas); print({loaded})") == "[]"


def test_the_engine_of_the_face_loads_no_rods() -> None:
    above = LAYERS[: LAYERS.index("continuation")]
    loaded = f"[m for m in sys.modules if m.startswith('rodatlas.') and m.split('.')[1] in {above}]"
    assert _python(f"import sys, rodatlas; rodatlas.trace; print({loaded})") == "[]"


def test_the_help_page_loads_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from rodatlas.cli import main\n"
        "sys.argv = ['rodatlas', '--help']\n"
        "try:\n    main()\nexcept SystemExit as leave:\n    assert not leave.code, leave.code\n"
        f"print([m for m in {HEAVY} if m in sys.modules])"
    )
    page = _python(code)
    assert "slice" in page
    assert page.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", BASE)
def test_modules_below_all_layers_load_nothing_else(name: str) -> None:
    own = f"rodatlas.{name}"
    code = (
        f"import sys, {own}\n"
        f"print([m for m in sys.modules if m in {HEAVY} or m.startswith('rodatlas.') and not m.startswith('{own}')])"
    )
    assert _python(code) == "[]"


def _python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()
