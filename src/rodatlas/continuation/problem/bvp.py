"""The continuous problem: a two-point boundary value problem traced once into exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from rodatlas.continuation.checks import as_finite, as_names, check_distinct, check_function, check_type, shown
from rodatlas.continuation.problem.continuous import ContinuousSymmetry, Generator, generators
from rodatlas.continuation.problem.layout import Inner, Place, check_place
from rodatlas.continuation.problem.observable import Observable
from rodatlas.continuation.problem.symmetry import Symmetry, check_names, checked, widened
from rodatlas.continuation.problem.traced import Statement, Trace
from rodatlas.continuation.problem.tracing import pattern_of


class BVP:
    r"""A boundary value problem on :math:`a \le s \le b`, with conditions at both ends and at places between.

    .. math:: u' = f(s, u, p), \qquad b(u(a), u(b), p) = 0, \qquad \int_a^b g(s, u, p)\,ds = 0

    Parameters
    ----------
    rhs : callable or sequence of callables
        `rhs(s, u, p)` returns the n derivatives, as a sequence in the order of `unknowns` or as a mapping by
        name. It is written in ordinary Python with NumPy functions and is called once, with symbols. Several
        functions are those of the pieces between breakpoints and inner points, from left to right.
    boundary : callable
        `boundary(left, right, p)` returns the boundary residuals; they may be nonlinear and coupled.
    integrals : callable or sequence of callables
        each `g(s, u, p)` must integrate to zero over the interval.
    unknowns : sequence of str
        names of the n components of u.
    parameters : mapping of str to float
        names and default values of the scalars p; a problem that is only to be solved needs none.
    observables : mapping of str to Observable
        functionals that are recorded along branches and can be used as events.
    scales : mapping of str to float
        typical size of unknowns and parameters; it enters the arclength norm. Missing unknowns are scaled by
        the first solution of a run, missing parameters by one.
    symmetries : sequence of Symmetry and ContinuousSymmetry
        maps of solutions to solutions, tested here; attributes `symmetries` (by name) and `gauges` hold the discrete
        ones as :class:`rodatlas.continuation.problem.symmetry.Action`, `generators` the continuous ones. Where a state
        breaks one of these, a phase condition is added that holds one member of its orbit.
    identities : callable
        `identities(u, p)` returns what vanishes all along every solution, such as the length of a quaternion minus
        one; symmetries have to hold only where it does.
    interval : (a, b)
        the ends: numbers, names of parameters, or functions of the parameters. A free parameter makes an unknown
        length.
    breakpoints : sequence
        places, given likewise, that are always mesh points: where a coefficient jumps, or another law begins.
    inner : sequence of Inner
        jumps of unknowns, and conditions, at places inside the interval.
    log : sequence of str
        positive parameters that are followed in their logarithm: steps, scales and tangents are its own; values,
        bounds and zeros those of the parameter.

    Raises
    ------
    ValueError
        when a function cannot be traced with symbols (`if`, `math.sin`), returns something else than numbers and
        expressions, or the wrong number of them, or depends on something that is not an argument; when there are
        fewer conditions than unknowns, or more than the parameters can meet; when a declared symmetry is none.

    Notes
    -----
    The problem has n_b + n_i - n + 1 free parameters on a branch: conditions (at the ends, integral, inner) minus
    unknowns, plus one.

    The order of places is that of the default parameters. Where a piece loses its length on the way, no solution is
    found: the branch ends there.

    Examples
    --------
    A column whose stiffness jumps from 1 to 4 at s = 0.3:

    >>> column = BVP(
    ...     [lambda s, u, p: [u.t, -p.P * np.sin(u.y)], lambda s, u, p: [u.t, -p.P / 4 * np.sin(u.y)]],
    ...     lambda left, right, p: [left.y, right.y],
    ...     unknowns=("y", "t"), parameters={"P": 15.0}, breakpoints=(0.3,),
    ... )
    """

    def __init__(
        self,
        rhs: Callable[[Any, Any, Any], Any] | Sequence[Callable[[Any, Any, Any], Any]],
        boundary: Callable[[Any, Any, Any], Any],
        integrals: Callable[..., Any] | Sequence[Callable[..., Any]] = (),
        *,
        unknowns: Sequence[str],
        parameters: Mapping[str, float] | None = None,
        observables: Mapping[str, Observable] | None = None,
        scales: Mapping[str, float] | None = None,
        symmetries: Sequence[Symmetry | ContinuousSymmetry] = (),
        identities: Callable[[Any, Any], Any] | None = None,
        interval: tuple[Place, Place] = (0.0, 1.0),
        breakpoints: Sequence[Place] = (),
        inner: Sequence[Inner] = (),
        log: Sequence[str] = (),
        name: str = "bvp",
    ):
        check_type("name", name, str, "a text")
        self.name = name
        self.unknowns = _names("unknowns", unknowns)
        self.parameters = _numbers("parameters", {} if parameters is None else parameters)
        observables = {} if observables is None else observables
        check_type("observables", observables, Mapping, "a mapping of names to observables")
        self.observables = dict(observables)
        self.scales = _numbers("scales", {} if scales is None else scales)
        _check_names(self.unknowns, self.parameters, self.observables, self.scales)
        functions = _functions("rhs", rhs), _functions("integrals", () if integrals is None else integrals)
        _check_functions(functions[0], boundary, functions[1], self.observables)
        self.log = _log("log", log, self.parameters)
        self._state(Statement(
            self.unknowns, self.parameters, self.log, functions[0], boundary, functions[1], _interval(interval),
            _places("breakpoints", breakpoints), _inner(inner), self.observables, identities,
        ))  # fmt: skip
        self.phases, self.unfoldings, self.plain = 0, 0, self
        self._unfolded: dict[tuple[int, int], BVP] = {}
        check_names(symmetries)
        self.symmetries, self.gauges = checked(self, [x for x in symmetries if isinstance(x, Symmetry)])
        self.generators: tuple[Generator, ...] = generators(
            self, [x for x in symmetries if isinstance(x, ContinuousSymmetry)]
        )

    def _state(self, said: Statement) -> None:
        """Trace a statement, and count its conditions."""
        found = Trace(said)
        self._said, self.parameters = said, dict(said.parameters)
        self.traced, self.layout, self.sparsity = found.functions, found.layout, found.sparsity
        self.n_boundary, self.n_inner = found.n_boundary, found.n_inner
        self.n_integral = found.n_integral + found.n_inner
        self._is_log = np.array([name in self.log for name in self.parameters], dtype=bool)
        self._check_count()

    def __repr__(self) -> str:
        conditions = self.conditions.replace(" + ", " and ")
        return (
            f"BVP({self.name}: {self.size} unknowns, {conditions} conditions, {self.n_free} free "
            f"parameter{'s' if self.n_free != 1 else ''})"
        )

    @property
    def size(self) -> int:
        return len(self.unknowns)

    @property
    def conditions(self) -> str:
        """Numbers of the conditions of each kind, in words."""
        inner = f" + {self.n_inner} inner" if self.n_inner else ""
        return f"{self.n_boundary} boundary + {self.n_integral - self.n_inner} integral{inner}"

    @property
    def n_free(self) -> int:
        """Number of free parameters along a branch."""
        return self.n_boundary + self.n_integral - self.size + 1

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(self.parameters)

    @property
    def idle(self) -> tuple[str, ...]:
        """Parameters on which neither an equation nor a condition depends, though observables may."""
        t = self.traced
        used = set[int]()
        for function, rows in ((t.field, self.size), (t.ends, self.n_boundary), (t.densities, self.n_integral)):
            found, columns = pattern_of(function.jac_sparsity(0, function.n_in() - 1))
            used |= set(columns[found < rows].tolist())
        return tuple(name for i, name in enumerate(self.parameters) if i not in used)

    def parameter_index(self, name: str) -> int:
        if name not in self.parameter_names:
            raise ValueError(f"parameter: expected one of {', '.join(self.parameters)}, got {shown(name)}")
        return self.parameter_names.index(name)

    def parameter_vector(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """Values of all parameters (np,), the defaults overridden by `values`."""
        values = {} if values is None else values
        check_type("parameters", values, Mapping, "a mapping of names to numbers")
        merged = dict(self.parameters)
        for key, value in values.items():
            self.parameter_index(key)
            merged[key] = as_finite("parameters", key, value)
        return np.array(list(merged.values()), dtype=float)

    def with_parameter(self, name: str) -> BVP:
        """The same problem with one more parameter, zero and without effect."""
        if self.phases:
            return self.plain.with_parameter(name).unfolded(self.phases, self.unfoldings)
        return self._restated(replace(self._said, parameters={**self.parameters, name: 0.0}))

    def with_value_of(self, observable: str, name: str) -> BVP:
        """The same problem with the value of an observable as one more parameter, and the condition that this makes.

        Symmetries are taken over as they are: in a subspace that one of them fixes, it leaves the value alone.

        Parameters
        ----------
        observable : one of the problem's; name : of the new parameter, the last one of the user's.
        """
        if self.phases:
            return self.plain.with_value_of(observable, name).unfolded(self.phases, self.unfoldings)
        held = {**self._said.held, observable: name}
        return self._restated(replace(self._said, parameters={**self.parameters, name: 0.0}, held=held))

    def unfolded(self, phases: int, unfoldings: int) -> BVP:
        """The same problem with room for phase conditions, and for unfolding parameters.

        Both are empty here. :class:`rodatlas.continuation.discrete.phase.Phase` fills them on a mesh. `plain` is the
        problem without them.
        """
        if phases == 0:
            return self
        if (phases, unfoldings) not in self._unfolded:
            more = {f"unfolding_of_phase_{i + 1}": 0.0 for i in range(unfoldings)}
            new = self._restated(replace(self._said, parameters={**self.parameters, **more}, phases=phases))
            new.phases, new.unfoldings, new.plain = phases, unfoldings, self
            self._unfolded[phases, unfoldings] = new
        return self._unfolded[phases, unfoldings]

    @property
    def own_parameters(self) -> tuple[str, ...]:
        """Names of the parameters without those that unfold phase conditions, which come last."""
        return self.parameter_names[: len(self.parameters) - self.unfoldings]

    def _restated(self, said: Statement) -> BVP:
        """The problem of a statement with more parameters at the end, which symmetries leave alone."""
        new = copy(self)
        new.plain, new._unfolded = new, {}
        new._state(said)
        more = len(said.parameters) - len(self.parameters)
        new.symmetries = {name: widened(action, more) for name, action in self.symmetries.items()}
        new.gauges = tuple(widened(action, more) for action in self.gauges)
        return new

    # -- what the engine computes with --------------------------------------------------------------------------------

    def coordinates(self, parameters: np.ndarray) -> np.ndarray:
        """Parameters (np,) as they are followed: logarithms where so declared.

        Those that unfold phase conditions may be left out: they are zero.
        """
        if len(parameters) < len(self.parameters):
            parameters = np.append(parameters, np.zeros(len(self.parameters) - len(parameters)))
        if not self.log:
            return parameters.copy()
        if not (parameters[self._is_log] > 0).all():
            name, value = next((n, v) for n, v in zip(self.parameters, parameters, strict=True)
                               if n in self.log and not v > 0)  # fmt: skip
            raise ValueError(f"log: expected a positive value of '{name}', got {value:g}")
        return np.where(self._is_log, np.log(np.where(self._is_log, parameters, 1.0)), parameters)

    def values(self, coordinates: np.ndarray) -> np.ndarray:
        """Inverse of :meth:`coordinates`."""
        if not self.log:
            return coordinates.copy()
        return np.where(self._is_log, np.exp(np.where(self._is_log, coordinates, 0.0)), coordinates)

    def coordinate(self, name: str, value: float) -> float:
        """A value of a parameter or observable as it is measured along branches: its logarithm where so declared."""
        if name not in self.log:
            return value
        return float(np.log(value)) if value > 0 else -np.inf

    def check_places(self, field: str, parameters: np.ndarray) -> None:
        """Raise ValueError where a piece has no length at some parameters (np,)."""
        found = self.places(parameters)[:, 1]
        if not (np.diff(found)[~self.layout.is_inner] > 0).all():
            shown = ", ".join(f"{value:g}" for value in dict.fromkeys(found))
            raise ValueError(f"{field}: expected parameters at which interval, breakpoints and inner points keep their "
                             f"order, got the places {shown}")  # fmt: skip

    def places(self, parameters: np.ndarray) -> np.ndarray:
        """Knots of the reference interval and the places that they stand for, (K+1, 2), at parameters (np,)."""
        if self.traced.fixed_places is not None:
            return self.traced.fixed_places
        found = np.asarray(self.traced.places(self.coordinates(parameters))).ravel()
        return np.column_stack([self.layout.knots, found[self.layout.places]])

    def _check_count(self) -> None:
        """A branch needs a free parameter, and no more of them than the problem has."""
        fewest = self.size - self.n_integral
        n_integral = self.n_integral - self.n_inner
        most = fewest + max(0, len(self.parameters) - 1)
        others = [f"{n} {kind}" for n, kind in ((n_integral, "integral"), (self.n_inner, "inner")) if n]
        with_integrals = f" and {' and '.join(others)} conditions" if others else ""
        if self.n_boundary < fewest:
            raise ValueError(
                f"boundary: expected at least {fewest} conditions for {self.size} unknowns{with_integrals}, got "
                f"{self.n_boundary}"
            )
        if self.n_boundary > most:
            raise ValueError(
                f"boundary: expected at most {most} conditions for {self.size} unknowns{with_integrals}, got "
                f"{self.n_boundary}: a branch would need {self.n_free} free parameters and there are only "
                f"{len(self.parameters)} ({', '.join(self.parameters)})"
            )

    def observable_slots(self) -> dict[str, tuple[str, int]]:
        """Place of each observable: ('integral' or 'end', row behind the conditions of that kind).

        A value at an inner point is an integral over the part of that point.
        """
        slots, count = {}, {"integral": self.n_integral, "end": self.n_boundary}
        for key, obs in self.observables.items():
            kind = "end" if obs.kind == "end" else "integral"
            slots[key] = (kind, count[kind])
            count[kind] += 1
        return slots


def _names(field: str, names: Any) -> tuple[str, ...]:
    return tuple(as_names(field, names, "a sequence of names such as ('u', 'v')"))


def _numbers(field: str, values: Any) -> dict[str, float]:
    check_type(field, values, Mapping, "a mapping of names to numbers")
    return {name: as_finite(field, name, values[name]) for name in _names(field, values)}


def _check_names(
    unknowns: Sequence[str],
    parameters: Mapping[str, float],
    observables: Mapping[str, Observable],
    scales: Mapping[str, float],
) -> None:
    if not unknowns:
        raise ValueError("unknowns: expected at least one name, got none")
    as_names("observables", observables, "a mapping of names to observables")
    names = [*unknowns, *parameters]
    for name in (everything := [*names, *observables]):
        if not name.isidentifier() or everything.count(name) > 1:
            raise ValueError(f"unknowns, parameters, observables: expected distinct identifiers, got '{name}'")
    for name, value in scales.items():
        if name not in names:
            raise ValueError(f"scales: expected one of {', '.join(names)}, got '{name}'")
        if value <= 0:
            raise ValueError(f"scales: expected a positive number for '{name}', got {value}")


def _functions(field: str, given: Any) -> tuple[Callable[..., Any], ...]:
    if callable(given):
        return (given,)
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ValueError(f"{field}: expected a function or a sequence of functions, got {shown(given)}")
    return tuple(given)


def _log(field: str, names: Any, parameters: Mapping[str, float]) -> tuple[str, ...]:
    check_distinct(field, names, "a sequence of names of parameters")
    for name in names:
        if name not in parameters:
            raise ValueError(f"{field}: expected some of {', '.join(parameters)}, got '{name}'")
        if not parameters[name] > 0:
            raise ValueError(f"{field}: expected a positive value of '{name}', got {parameters[name]:g}")
    return tuple(names)


def _interval(given: Any) -> tuple[Place, Place]:
    ends = _places("interval", given)
    if len(ends) != 2:
        raise ValueError(f"interval: expected the two ends (a, b), got {given!r}")
    return ends[0], ends[1]


def _places(field: str, given: Any) -> tuple[Place, ...]:
    if isinstance(given, str) or not isinstance(given, (Sequence, np.ndarray)):
        raise ValueError(f"{field}: expected a sequence of places, got {given!r}")
    for at in given:
        check_place(field, at)
    return tuple(at if isinstance(at, str) or callable(at) else float(at) for at in given)


def _inner(given: Any) -> tuple[Inner, ...]:
    if not isinstance(given, Sequence) or not all(isinstance(x, Inner) for x in given):
        raise ValueError(f"inner: expected a sequence of Inner(at, jumps, conditions), got {given!r}")
    if len({x.at for x in given}) < len(given):
        raise ValueError("inner: expected one Inner for each place, got two at the same: put all it holds into one")
    return tuple(given)


def _check_functions(
    rhs: Sequence[Any], boundary: Any, integrals: Sequence[Any], observables: Mapping[str, Any]
) -> None:
    for field, function in (*(("rhs", f) for f in rhs), ("boundary", boundary), *(("integrals", g) for g in integrals)):
        check_function(field, function)
    for name, observable in observables.items():
        if not isinstance(observable, Observable):
            raise ValueError(
                f"observables: expected integral_of(function), end_value(function) or value_at(place, function) for "
                f"'{name}', got {observable!r}"
            )
