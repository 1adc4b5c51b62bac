"""What is of another kind than expected: every public function says so in one line, before it computes anything."""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from rodatlas.atlas import (
    Loci,
    Slice,
    SliceSettings,
    compute_loci,
    compute_phase,
    compute_slice,
)
from rodatlas.atlas.experiments.real_band import band_report
from rodatlas.atlas.study import StatesSettings, Study, run_study
from rodatlas.continuation import BVP, Solution, TraceOptions, trace
from rodatlas.continuation.checks import as_path, check_each, shown
from rodatlas.paper.model import band_loci, band_phase, band_slice
from rodatlas.plot import draw_loci, draw_slice, draw_triad
from rodatlas.rods import (
    Band,
    BandUnits,
    ClampErrors,
    Ends,
    RodState,
    index_of,
    limiting_shear,
    planar_states,
    state_at,
)
from rodatlas.states import find_states

FACES = ("continuation", "rods", "states", "atlas", "plot", "plot.exports", "atlas.study")
WRONG = (15.0, "x", None, object())


def is_record(value: Any) -> bool:
    """Made by a computation, not by a user: an exception, a kind, or a plain record that checks nothing."""
    kinds = (enum.Enum, BaseException, tuple)
    plain = dataclasses.is_dataclass(value) and not hasattr(value, "__post_init__")
    return isinstance(value, type) and (issubclass(value, kinds) or plain)


def functions() -> Iterator[tuple[str, Callable[..., Any], int]]:
    """Public functions and classes of all faces that take an argument, and how many they need."""
    for package in FACES:
        face = import_module(f"rodatlas.{package}")
        for name in face.__all__:
            value = getattr(face, name)
            if not callable(value) or is_record(value):
                continue
            parameters = [p for p in inspect.signature(value).parameters.values() if p.kind == p.POSITIONAL_OR_KEYWORD]
            needed = sum(p.default is p.empty for p in parameters)
            if parameters:
                yield f"{package}.{name}", value, max(1, needed)


def what_is_said(function: Callable[..., Any], wrong: object, needed: int) -> str | None:
    """The error for a wrong first argument; None where it is accepted. A TypeError is Python's own."""
    try:
        function(wrong, *[None] * (needed - 1))
    except (ValueError, TypeError) as error:
        return str(error)
    return None


@pytest.mark.parametrize(("name", "function", "needed"), [pytest.param(*f, id=f[0]) for f in functions()])
def test_a_wrong_argument_is_named(name: str, function: Callable[..., Any], needed: int) -> None:
    said = [line for line in (what_is_said(function, wrong, needed) for wrong in WRONG) if line is not None]
    assert all(": expected " in line or "missing" in line for line in said), said
    assert all("\n" not in line for line in said)
    assert len(said) >= 2, "a number, a text, None and an object: most of them must be wrong"


def test_there_are_many_public_functions() -> None:
    assert len(list(functions())) > 60


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: state_at(15.0), r"ends: expected Ends such as Ends\(15.0\), got 15.0"),
        (lambda: state_at(Ends(15.0), band="x"), "band: expected a Band, or Poisson's ratio, got 'x'"),
        (lambda: compute_slice(15.0), "settings: expected SliceSettings, see SliceSettings.of, got 15.0"),
        (lambda: index_of(3), "solution: expected a Solution such as .*, got 3"),
        (lambda: RodState("x"), "solution: expected a Solution such as .*, got 'x'"),
        (lambda: BandUnits(3), r"band: expected a Band such as Band\(240.0, 3.0, 0.127\), got 3"),
        (lambda: band_report(3, ClampErrors()), "units: expected BandUnits such as .*, got 3"),
        (lambda: band_report(BandUnits(Band()), 3), "errors: expected ClampErrors such as .*, got 3"),
        (lambda: run_study("x", "out"), "study: expected a Study, .*, got 'x'"),
        (lambda: Study.of("x", [15.0]), "settings: expected "),
        (lambda: Study.of("x", 15.0), "settings: expected "),
        (lambda: StatesSettings("x", 0.0), "angle: expected degrees between -180 and 180, got 'x'"),
        (lambda: limiting_shear(15.0), "compression: expected a number from 0 to 1, got 15.0"),
        (lambda: planar_states(0.625, "x", 0.5), "angle: expected a finite number of radians, got 'x'"),
        (lambda: TraceOptions(step=3), r"step: expected StepControl\(..\), got 3"),
        (lambda: TraceOptions(bounds=3), "bounds: expected a mapping of names .*, got 3"),
        (lambda: TraceOptions(locate="fold"), "locate: expected some of .*, got 'fold'"),
    ],
)  # fmt: skip
def test_some_errors_to_the_letter(call: Callable[[], Any], line: str) -> None:
    with pytest.raises(ValueError, match=f"^{line}"):
        call()


@pytest.fixture(scope="module")
def bratu() -> tuple[BVP, Solution]:
    bvp = BVP(
        lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(u.u)}, lambda left, right, p: [left.u, right.u],
        unknowns=("u", "v"), parameters={"lam": 0.0},
    )  # fmt: skip
    return bvp, Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)


def test_free_parameters_that_are_no_names(bratu: tuple[BVP, Solution]) -> None:
    for free in ("lam", 3, (3,)):
        with pytest.raises(ValueError, match="free: expected names of parameters"):
            trace(*bratu, free)
    with pytest.raises(ValueError, match="options: expected TraceOptions, got 3"):
        trace(*bratu, ("lam",), 3)


def test_a_solution_of_another_problem_is_no_rod(bratu: tuple[BVP, Solution]) -> None:
    for function in (index_of, RodState):
        with pytest.raises(ValueError, match=r"solution: expected one with N1, .*, got one with u, v"):
            function(bratu[1])


@pytest.mark.parametrize("compression", [0.01, 0.1, 0.4, 0.9, 0.99])
@pytest.mark.parametrize("kind", [band_loci, band_phase, lambda held: BandUnits(Band(), held)])
def test_defaults_fit_any_compression(kind: Callable[[float], Any], compression: float) -> None:
    settings = kind(compression)
    if not isinstance(settings, BandUnits):
        assert isinstance(settings.slice_at(15.0), SliceSettings)
        assert settings.high < limiting_shear(compression)
    else:
        assert 0.0 < settings.limit < limiting_shear(compression)


def test_what_came_is_shown_on_one_short_line() -> None:
    class Long:
        def __repr__(self) -> str:
            return "a\n" * 1000

    assert len(shown(Long())) < 100
    assert "\n" not in shown(Long())


def test_a_text_is_no_sequence_of_texts() -> None:
    with pytest.raises(ValueError, match="names: expected names, got 'abc'"):
        check_each("names", "abc", str, "names")
    check_each("names", ["a", "b"], str, "names")


def test_paths_come_as_text_too() -> None:
    assert as_path("folder", "out").name == "out"
    with pytest.raises(ValueError, match="folder: expected the path of a file or folder, got 3"):
        as_path("folder", 3)


@pytest.mark.parametrize(("call", "message"), [
    (lambda s: band_slice(15.0, search="a"), "search: expected a whole number from 0 to 1000000, got 'a'"),
    (lambda s: band_slice(15.0, search=None), "search: expected a whole number from 0 to 1000000, got None"),
    (lambda s: band_slice(15.0, search=2.5), "search: expected a whole number from 0 to 1000000, got 2.5"),
    (lambda s: band_slice(15.0, search=10**7), "search: expected a whole number from 0 to 1000000, got 10000000"),
    (lambda s: band_slice(True), "angle: expected degrees with 0 <= angle < 90, got True"),
    (lambda s: s.state("W", "a"), "shear: expected a number, got 'a'"),
    (lambda s: s.states_at(float("nan")), "shear: expected a number, got nan"),
    (lambda s: s.state(3, 0.0), "name: expected the name of a state such as S+-, got 3"),
    (lambda s: s.save(""), "path: expected a file name, got '.'"),
    (lambda s: s.save(None), "path: expected the path of a file or folder, got None"),
    (lambda s: type(s).load(3), "path: expected the path of a file or folder, got 3"),
    (lambda s: find_states(Ends(15.0), starts="a"), "starts: expected a whole number of at least 1, got 'a'"),
    (lambda s: find_states(Ends(15.0), starts=2.5), "starts: expected a whole number of at least 1, got 2.5"),
    (lambda s: find_states(Ends(15.0), threads=0), "threads: expected a whole number of at least 1, got 0"),
    (lambda s: find_states(Ends(15.0), deflate=None), "deflate: expected a whole number of at least 0, got None"),
    (lambda s: compute_loci(band_loci(), lambda a: s, 4), "numbers: expected a sequence of whole numbers, got 4"),
    (lambda s: compute_loci(band_loci(), lambda a: 3), "slice_of: expected a function that gives slices, see"),
    (lambda s: compute_loci(band_loci(0.4), lambda a: s), "slice_of: expected the slice at angle 15 deg, "
     "compression 0.4, poisson 0.25, got that at angle 15 deg, compression 0.5, poisson 0.25"),
    (lambda s: compute_phase(band_phase(0.4), Loci(band_loci(), (), (), ()), lambda a: []),
     "loci: expected those of PhaseSettings(band, compression 0.4, poisson 0.25: "),
    (lambda s: draw_slice(s, 3), "ax: expected axes of matplotlib, got 3"),
    (lambda s: draw_loci(Loci(band_loci(), (), (), ()), (), "x"), "ax: expected axes of matplotlib"),
    (lambda s: draw_triad(ax=3), "ax: expected axes of matplotlib, got 3"),
])  # fmt: skip
def test_what_a_user_may_slip_in_is_named(call: Callable[[Slice], object], message: str) -> None:
    """Arguments beyond the first, those of methods, and results of another band than the settings say."""
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        call(Slice(band_slice(15.0), (), (), (), 0.0))
