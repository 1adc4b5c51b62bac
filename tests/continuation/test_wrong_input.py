"""Every argument of the engine replaced by what makes no sense: one clear line, before anything is computed."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable, Iterator
from dataclasses import fields
from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from bvp_problems import algebraic, bratu, constant, pitchfork

import rodatlas.continuation
from rodatlas.continuation import (
    BVP,
    ContinuousSymmetry,
    EndReason,
    Inner,
    MeshControl,
    NewtonOptions,
    Solution,
    StepControl,
    Symmetry,
    TraceOptions,
    broken_at,
    deflated_solve,
    end_value,
    erf,
    fold_locus_at,
    follow,
    follow_locus,
    image,
    integral_of,
    is_symmetry,
    isotropy,
    other_solutions,
    sensitivity,
    solve,
    switch,
    switch_all,
    tabulated,
    trace,
    value_at,
)
from rodatlas.continuation.checks import WrongInput, check_number
from rodatlas.continuation.curve.start import first_state

WRONG = {
    "None": None, "True": True, "a text": "text", "NaN": float("nan"), "infinity": float("inf"), "-1": -1, "0": 0,
    "1.5": 1.5, "an object": object(), "empty list": [], "empty mapping": {}, "list of None": [None],
    "list of True": [True], "a name twice": ("lam", "lam"),
}  # fmt: skip
NONE, EMPTY = "None", ("empty list", "empty mapping")
NUMBERS = ("-1", "0", "1.5")
SHORT = TraceOptions(max_points=3)


def conditions(left: Any, right: Any, p: Any) -> list[Any]:
    return [left.u, right.u]


def oscillator(**changes: Any) -> BVP:
    """u'' + lam u = 0 with some arguments replaced."""
    given = {"rhs": lambda s, u, p: [u.v, -p.lam * u.u], "boundary": conditions, "unknowns": ("u", "v"),
             "parameters": {"lam": 1.0}}  # fmt: skip
    return BVP(**(given | changes))


def oscillator_of(**parts: Any) -> BVP:
    """The same, with single entries of its arguments replaced."""
    return oscillator(
        parameters={"lam": parts.get("parameter", 1.0)}, scales={"u": parts.get("scale", 1.0)},
        observables={"o": parts.get("observable", integral_of(lambda s, u, p: u.u))},
        interval=(parts.get("start", 0.0), parts.get("end", 2.0)), breakpoints=[parts.get("breakpoint", 0.5)],
        symmetries=[parts.get("symmetry", Symmetry("flip", {"u": -1, "v": -1}))],
        inner=[parts.get("inner", Inner(0.7, jumps=lambda u, p: {"v": 0.0}))], log=[parts.get("log", "lam")],
    )  # fmt: skip


def flipped(**parts: Any) -> BVP:
    flip = Symmetry("flip", {"u": parts.get("factor", -1), "v": -1}, {"lam": parts.get("on_parameter", 1)})
    return oscillator(symmetries=[flip])


class Runs:
    """What runs start from: computed once."""

    def __init__(self) -> None:
        self.bvp, self.start = bratu(), constant(bratu())
        self.branch = trace(self.bvp, self.start, ("lam",), TraceOptions(max_points=40))
        self.fold = self.branch.of_kind("fold")[0]
        self.fork = pitchfork()
        box = TraceOptions(bounds={"lam": (-1.0, 1.0)})
        (self.point,) = trace(self.fork, constant(self.fork, lam=-0.5), ("lam",), box).special
        self.plane = algebraic(lambda u, p: [p.lam + p.mu - u.x**2], parameters=("lam", "mu"))
        start = constant(self.plane, [1.0], lam=1.0)
        turn = trace(self.plane, start, ("lam",), TraceOptions(bounds={"lam": (-1.0, 2.0)})).special[0]
        self.turn, self.locus = turn, follow_locus(self.plane, turn, ("lam", "mu"), SHORT)
        self.frame = first_state(self.bvp, self.start, ("lam",), SHORT)
        self.mirror = oscillator(symmetries=[Symmetry("flip", {"u": -1, "v": -1})])
        self.rest = solve(self.mirror, constant(self.mirror))


@lru_cache(maxsize=1)
def runs() -> Runs:
    return Runs()


def by_default(kind: Any) -> dict[str, Any]:
    return {f.name: f.default for f in fields(kind)}


Case = tuple[Callable[..., Any], Callable[[], dict[str, Any]], dict[str, tuple[str, ...]]]
"""What is called, arguments with which it works, and what else makes sense for some of them."""

CONSTRUCTORS: dict[str, Case] = {
    "BVP": (oscillator, lambda: {
        "rhs": None, "boundary": None, "integrals": (), "unknowns": None, "parameters": None, "observables": {},
        "scales": {}, "symmetries": (), "identities": None, "interval": None, "breakpoints": (), "inner": (), "log": (),
        "name": "",
     }, {"integrals": (NONE, "empty list"), "observables": (NONE, "empty mapping"), "scales": (NONE, "empty mapping"),
         "symmetries": ("empty list",), "breakpoints": ("empty list",), "inner": ("empty list",), "log": EMPTY,
         "identities": (NONE,), "name": ("a text",)}),
    "entries of a BVP": (oscillator_of, lambda: dict.fromkeys(
        ("parameter", "scale", "observable", "start", "end", "breakpoint", "symmetry", "inner", "log")),
     {"parameter": ("1.5",), "scale": ("1.5",), "start": ("-1", "0"), "end": ("1.5",), "breakpoint": ("1.5",)}),
    "ContinuousSymmetry": (
        lambda **k: ContinuousSymmetry(**({"name": "turn", "generator": conditions} | k)),
        lambda: {"name": "", "generator": None, "shift": False, "parameters": None},
        {"name": ("a text",), "shift": ("True",), "parameters": (NONE,)}),
    "Symmetry": (
        lambda **k: oscillator(symmetries=[Symmetry(**({"name": "flip", "unknowns": {"u": -1, "v": -1}} | k))]),
        lambda: {"name": "", "unknowns": None, "parameters": None, "reverse": False, "gauge": False},
        {"name": ("a text",), "unknowns": ("empty mapping",), "parameters": ("empty mapping",), "reverse": ("True",),
         "gauge": ("True",)}),
    "entries of a Symmetry": (flipped, lambda: {"factor": -1, "on_parameter": 1},
                              {"factor": ("-1",), "on_parameter": ("-1",)}),
    "Inner": (lambda **k: Inner(**({"at": 0.5, "jumps": conditions} | k)),
              lambda: {"at": 0.5, "jumps": None, "conditions": None},
              {"at": ("a text", *NUMBERS), "conditions": (NONE,)}),
    "integral_of": (integral_of, lambda: {"function": None}, {}),
    "end_value": (end_value, lambda: {"function": None}, {}),
    "value_at": (lambda **k: value_at(**({"at": 0.5, "function": conditions} | k)),
                 lambda: {"at": 0.5, "function": None, "side": "left"}, {"at": ("a text", *NUMBERS)}),
    "tabulated": (lambda **k: tabulated(**({"x": [0, 1, 2, 3], "y": [0, 1, 2, 3]} | k)),
                  lambda: {"x": None, "y": None, "kind": "cubic", "extend": False}, {"extend": ("True",)}),
    "erf": (erf, lambda: {"x": 0.0},
            {"x": ("True", "NaN", "infinity", *NUMBERS, "empty list", "list of None", "list of True")}),
    "StepControl": (StepControl, lambda: by_default(StepControl),
                    {"maximum": ("infinity", "1.5"), "target": ("1.5",), "max_correction": ("1.5",),
                     "growth": ("1.5",)}),
    "MeshControl": (MeshControl, lambda: by_default(MeshControl), {}),
    "intervals of a MeshControl": (lambda **k: MeshControl(intervals=tuple(({"few": 10, "most": 40} | k).values())),
                                   lambda: {"few": 10, "most": 40}, {}),
    "NewtonOptions": (NewtonOptions, lambda: by_default(NewtonOptions),
                      {"tolerance": ("1.5",), "max_growth": ("infinity", "1.5"), "chord": ("True",)}),
    "TraceOptions": (TraceOptions, lambda: dict.fromkeys(f.name for f in fields(TraceOptions)), {
        "bounds": ("empty mapping",), "zeros": ("empty mapping",), "extrema": EMPTY, "locate": EMPTY, "within": EMPTY,
        "index": (NONE,), "stop_at": (NONE,), "on_point": (NONE,), "max_folds": (NONE, "0"), "backend": (NONE,)}),
    "entries of TraceOptions": (
        lambda **k: TraceOptions(
            bounds={"lam": (k.get("low", -2.0), k.get("high", 4.0))},
            zeros={"mean": k.get("zero", 0.5), "lam": [k.get("one", 0.2), 2.0]}, extrema=(k.get("extremum", "mean"),),
            locate=(k.get("kind", "fold"),), within=(k.get("within", "flip"),)),
        lambda: dict.fromkeys(("low", "high", "zero", "one", "extremum", "kind", "within")),
        {"low": NUMBERS, "high": ("infinity", *NUMBERS), "zero": NUMBERS, "one": NUMBERS, "extremum": ("a text",),
         "within": ("a text",)}),
    "from_function": (
        lambda **k: Solution.from_function(
            **({"function": lambda s: np.zeros((len(s), 2)), "unknowns": ("u", "v"), "parameters": {"lam": 0.0}} | k)),
        lambda: dict.fromkeys(("function", "unknowns", "parameters", "intervals", "points", "interval")),
        {"parameters": ("empty mapping",)}),
    "entries of from_function": (
        lambda **k: Solution.from_function(
            lambda s: np.zeros((len(s), 2)), (k.get("unknown", "u"), "v"), {"lam": k.get("value", 0.0)},
            interval=(k.get("start", -2.0), k.get("end", 4.0))),
        lambda: dict.fromkeys(("unknown", "value", "start", "end")),
        {"unknown": ("a text",), "value": NUMBERS, "start": NUMBERS, "end": NUMBERS}),
    "from_values": (
        lambda **k: Solution.from_values(
            **({"s": [0, 1], "values": np.zeros((2, 2)), "unknowns": ("u", "v"), "parameters": {"lam": 0.0}} | k)),
        lambda: dict.fromkeys(("s", "values", "unknowns", "parameters", "points")),
        {"parameters": ("empty mapping",)}),
    "from_table": (
        lambda **k: Solution.from_table(
            **({"table": {"s": [0, 1], "u": [0, 0]}, "unknowns": ("u",), "parameters": {"lam": 0.0}} | k)),
        lambda: dict.fromkeys(("table", "unknowns", "parameters", "points", "s")),
        {"parameters": ("empty mapping",), "table": ("a text",)}),  # no such file
}  # fmt: skip

VERBS: dict[str, Case] = {
    "solve": (solve, lambda: {"bvp": runs().bvp, "guess": runs().start, "free": ("lam",), "options": SHORT},
              {"free": (NONE,), "options": (NONE,)}),
    "trace": (trace, lambda: {"bvp": runs().bvp, "start": runs().start, "free": ("lam",), "options": SHORT,
                              "both": True, "direction": 1.0, "scale": None},
              {"options": (NONE,), "both": ("True",), "direction": ("-1", "1.5"), "scale": (NONE,)}),
    "follow": (follow, lambda: {"frame": runs().frame, "options": SHORT, "both": True, "start": EndReason.START,
                                "arclength": 0.0},
               {"both": ("True",), "arclength": NUMBERS}),
    "follow_locus": (follow_locus, lambda: {"bvp": runs().plane, "start": runs().turn, "free": ("lam", "mu"),
                                            "options": SHORT, "both": True},
                     {"options": (NONE,), "both": ("True",)}),
    "switch": (switch, lambda: {"bvp": runs().fork, "at": runs().point, "free": ("lam",), "options": SHORT, "side": 1,
                                "ray": None, "scale": None, "first_step": None},
               {"options": (NONE,), "side": ("-1",), "ray": (NONE, "0"), "scale": (NONE,),
                "first_step": (NONE, "1.5")}),
    "switch_all": (switch_all, lambda: {"bvp": runs().fork, "at": runs().point, "free": ("lam",), "options": SHORT,
                                        "scale": None, "first_step": None},
                   {"options": (NONE,), "scale": (NONE,), "first_step": (NONE, "1.5")}),
    "deflated_solve": (deflated_solve, lambda: {"bvp": runs().bvp, "guess": runs().start, "known": [runs().start],
                                                "free": ("lam",), "options": SHORT, "power": 2.0, "shift": 1.0},
                       {"known": EMPTY, "free": (NONE,), "options": (NONE,), "power": ("1.5",),
                        "shift": ("0", "1.5")}),
    "other_solutions": (other_solutions, lambda: {
        "bvp": runs().bvp, "known": [runs().start], "free": ("lam",), "options": SHORT, "guesses": None, "limit": 1,
        "images": (), "power": 2.0, "shift": 1.0,
     }, {"free": (NONE,), "options": (NONE,), "guesses": (NONE, *EMPTY), "limit": ("0",), "images": EMPTY,
         "power": ("1.5",), "shift": ("0", "1.5")}),
    "sensitivity": (sensitivity, lambda: {"bvp": runs().bvp, "special": runs().fold, "of": None}, {"of": (NONE,)}),
    "image": (image, lambda: {"bvp": runs().mirror, "symmetry": "flip", "solution": runs().rest}, {}),
    "isotropy": (isotropy, lambda: {"bvp": runs().mirror, "solution": runs().rest, "tolerance": 1e-5, "among": None},
                 {"tolerance": ("0", "1.5"), "among": (NONE, *EMPTY)}),
    "broken_at": (broken_at, lambda: {"bvp": runs().fork, "special": runs().point, "among": None},
                  {"among": (NONE, *EMPTY)}),
    "is_symmetry": (is_symmetry, lambda: {"bvp": runs().mirror, "guess": Symmetry("flip")}, {}),
    "fold_locus_at": (fold_locus_at, lambda: {"bvp": runs().plane, "locus": runs().locus, "event": None}, {}),
}  # fmt: skip

METHODS: dict[str, Case] = {
    "Solution()": (lambda **k: runs().start(**({"s": 0.5} | k)), lambda: dict.fromkeys(("s", "name", "side")),
                   {"s": ("True", "0", "empty list", "list of True"), "name": (NONE,)}),
    "Solution[]": (lambda name: runs().start[name], lambda: {"name": "lam"}, {}),
    "Solution.parameter": (lambda name: runs().start.parameter(name), lambda: {"name": "lam"}, {}),
    "Solution.with_parameters": (lambda lam: runs().start.with_parameters(lam=lam), lambda: {"lam": 1.0},
                                 {"lam": NUMBERS}),
    "Solution.remesh": (lambda **k: runs().start.remesh(**({"mesh": [0.0, 1.0]} | k)),
                        lambda: dict.fromkeys(("mesh", "points")), {"points": (NONE,)}),
    "Solution.save": (lambda path: runs().start.save(path), lambda: {"path": ""}, {"path": ("a text",)}),
    "Branch.of_kind": (lambda kind: runs().branch.of_kind(kind), lambda: {"kind": "fold"}, {}),
    "Branch.column": (lambda name: runs().branch.column(name), lambda: {"name": "lam"}, {}),
    "Branch.plot": (lambda **k: runs().branch.plot(**({"x": "lam", "y": "mean"} | k)),
                    lambda: dict.fromkeys(("x", "y", "ax", "color")), {"ax": (NONE,), "color": (NONE,)}),
    "Branch.save": (lambda path: runs().branch.save(path), lambda: {"path": ""}, {"path": ("a text",)}),
    "Locus.of_kind": (lambda kind: runs().locus.of_kind(kind), lambda: {"kind": "cusp"}, {}),
    "Locus.column": (lambda name: runs().locus.column(name), lambda: {"name": "lam"}, {}),
    "Locus.plot": (lambda **k: runs().locus.plot(**k), lambda: dict.fromkeys(("x", "y", "ax")),
                   {"x": (NONE,), "y": (NONE,), "ax": (NONE,)}),
    "Locus.save": (lambda path: runs().locus.save(path), lambda: {"path": ""}, {"path": ("a text",)}),
    "BVP.parameter_vector": (lambda values: runs().bvp.parameter_vector(values), lambda: {"values": {}},
                             {"values": (NONE, "empty mapping")}),
}  # fmt: skip


def arguments() -> Iterator[Any]:
    """Every argument of every call, by name."""
    for name, (call, good, fine) in (CONSTRUCTORS | VERBS | METHODS).items():
        names = inspect.signature(call).parameters if name in VERBS else good()
        for argument in names:
            if not (name == "fold_locus_at" and argument == "options"):  # looked at after the event
                yield pytest.param(call, good if name in VERBS else dict, argument, fine.get(argument, ()),
                                   id=f"{name}: {argument}")  # fmt: skip


@pytest.mark.parametrize(("call", "good", "argument", "fine"), list(arguments()))
def test_what_makes_no_sense_is_named(
    call: Callable[..., Any], good: Callable[[], dict[str, Any]], argument: str, fine: tuple[str, ...]
) -> None:
    for label, wrong in WRONG.items():
        if label in fine:
            continue
        with pytest.raises((ValueError, KeyError), match=": expected ") as caught:
            call(**{**good(), argument: wrong})
        assert "\n" not in str(caught.value), label


def test_every_argument_of_the_verbs_is_tried() -> None:
    tried = {name.partition("(")[0] for name in (*CONSTRUCTORS, *VERBS)} | {"Solution"}
    records = {"Branch", "Locus", "Point", "LocusPoint", "LocusEvent", "SpecialPoint", "NormalForm", "Discrepancy",
               "EndReason", "Status", "NewtonCode", "NotConverged", "Effect"}  # fmt: skip
    assert set(rodatlas.continuation.__all__) == (tried & set(rodatlas.continuation.__all__)) | records
    for name in VERBS:
        given = VERBS[name][1]()
        assert set(given) >= {
            p.name for p in inspect.signature(VERBS[name][0]).parameters.values() if p.default is p.empty
        }


def test_a_misspelt_style_is_named_by_python() -> None:
    with pytest.raises(TypeError, match="unexpected keyword argument 'colour'"):
        runs().branch.plot("lam", "mean", colour="r")
    with pytest.raises(ValueError, match="color: expected a color of matplotlib, got 'grean'"):
        runs().branch.plot("lam", "mean", color="grean")


def test_kinds_of_special_points() -> None:
    """A kind that exists in principle and was not found is no error."""
    branch, locus = runs().branch, runs().locus
    assert [x.kind for x in branch.of_kind("fold")] == ["fold"]
    for kind in ("branch point", "zero of mean", "zero of lam", "extremum of slope"):
        assert branch.of_kind(kind) == ()
    with pytest.raises(ValueError, match=r"kind: expected one of fold, branch point, zero of NAME, .* got 'nope'"):
        branch.of_kind("nope")
    with pytest.raises(ValueError, match="where NAME is lam or mean or slope, got 'zero of mu'"):
        branch.of_kind("zero of mu")
    assert locus.of_kind("criticality") == locus.of_kind("zero of mu") == ()
    with pytest.raises(ValueError, match=r"kind: expected one of cusp, criticality, .* got 'fold'"):
        locus.of_kind("fold")


def test_names_that_come_twice() -> None:
    with pytest.raises(ValueError, match=r"log: expected .*, each once, got 'lam' twice"):
        oscillator(log=("lam", "lam"))
    with pytest.raises(ValueError, match=r"extrema: expected .*, each once, got 'mean' twice"):
        TraceOptions(extrema=("mean", "mean"))


def test_a_misspelt_parameter_in_a_function() -> None:
    with pytest.raises(ValueError, match=r"rhs: expected .*no name 'lamda': expected one of lam"):
        oscillator(rhs=lambda s, u, p: [u.v, -p.lamda * u.u])


def test_a_locus_in_parameters_without_effect() -> None:
    """One of them makes a straight line; with two, or as an inner one, it leaves the problem singular."""
    bvp = BVP(
        lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u, left.v - p.k],
        unknowns=("u", "v"), parameters={"lam": 1.0, "k": 0.5, "idle": 0.2, "q": 1.0},
        observables={"product": end_value(lambda left, right, p: p.q * left.v)},
    )  # fmt: skip
    assert bvp.idle == ("idle", "q")
    fold = trace(bvp, constant(bvp), ("lam", "k"), TraceOptions(max_points=40)).of_kind("fold")[0]
    line = follow_locus(bvp, fold, ("lam", "idle", "k"), TraceOptions(bounds={"idle": (0.0, 0.3)}))
    np.testing.assert_allclose(line.column("lam"), fold.solution["lam"], rtol=1e-10)
    assert sorted(line.column("idle"))[:: len(line) - 1] == pytest.approx([0.0, 0.3], abs=1e-12)
    for free in (("lam", "k", "idle"), ("k", "idle", "lam"), ("lam", "idle", "q")):
        with pytest.raises(ValueError, match=r"free: expected parameters on which .* depends, got 'idle'"):
            follow_locus(bvp, fold, free, SHORT)


def test_wrong_input_tells_its_field_apart() -> None:
    """So that who read it from a file can give its name there; in another process too."""
    with pytest.raises(WrongInput) as caught:
        check_number("shear-max", "x", 0.0, 1.0, "a number from 0 to 1")
    for error in (caught.value, pickle.loads(pickle.dumps(caught.value))):
        assert (error.field, error.rest) == ("shear-max", "expected a number from 0 to 1, got 'x'")
        assert str(error) == "shear-max: expected a number from 0 to 1, got 'x'"
        assert isinstance(error, ValueError)
