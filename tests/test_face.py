"""`import rodatlas`: the names that are needed first, each from the package that has it."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

import rodatlas


def for_type_checkers() -> dict[str, set[str]]:
    """Names that the face imports for type checkers, by package."""
    tree = ast.parse(Path(rodatlas.__file__).read_text(encoding="utf-8"))
    guarded = next(n for n in tree.body if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING")
    return {n.module.removeprefix("rodatlas."): {a.name for a in n.names} for n in guarded.body}


def test_what_a_type_checker_sees_is_what_runs() -> None:
    assert for_type_checkers() == {package: set(names) for package, names in rodatlas._NAMES.items()}
    assert sorted(rodatlas.__all__) == sorted(rodatlas._HOME)


@pytest.mark.parametrize("name", rodatlas.__all__)
def test_a_name_is_that_of_its_package_and_documented(name: str) -> None:
    home = import_module(f"rodatlas.{rodatlas._HOME[name]}")
    assert getattr(rodatlas, name) is getattr(home, name)
    assert name in home.__all__
    assert getattr(rodatlas, name).__doc__


def test_the_names_are_listed_for_completion() -> None:
    assert {*rodatlas.__all__, "atlas", "rods", "__version__"} <= set(dir(rodatlas))


def test_packages_need_no_import_of_their_own() -> None:
    assert rodatlas.states.find_states is rodatlas.find_states


@pytest.mark.parametrize(
    ("wrong", "right"), [("compute_slcie", "compute_slice"), ("ends", "Ends"), ("Tracing", "trace"), ("plots", "plot")]
)
def test_a_misspelt_name_is_told_what_is_near(wrong: str, right: str) -> None:
    with pytest.raises(AttributeError, match=f"no attribute '{wrong}'; did you mean .*{right}"):
        getattr(rodatlas, wrong)


def test_a_name_like_no_other_gets_no_advice() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'xyzzy'$"):
        rodatlas.xyzzy  # noqa: B018


def test_the_module_says_where_things_are() -> None:
    page = rodatlas.__doc__ or ""
    assert all(f"`rodatlas.{package}" in page for package in ("atlas", "states", "plot", "rods", "continuation"))


def test_a_search_is_a_table_too() -> None:
    found = rodatlas.find_states(rodatlas.Ends(30.0, shear=0.2), classes="+", starts=16, stable_only=True, threads=1)
    table = found.to_frame()
    assert len(table) == len(found.states) > 0
    assert {"name", "class", "index", "energy", "height", "inflections_k1", "met"} <= set(table.columns)
    assert table["energy"].tolist() == [s.solution["energy"] for s in found.states]
