"""The continuous problem: a two-point boundary value problem traced once into exact derivatives."""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rodatlas.continuation.linear.sparsity import strong_components
from rodatlas.continuation.problem.continuous import ContinuousSymmetry, Generator, generators
from rodatlas.continuation.problem.symmetry import Symmetry, check_names, checked, widened


class Named:
    """Symbols (or numbers) reachable by name, by index and by iteration, for use in a user's functions."""

    __slots__ = ("_names", "_values")

    def __init__(self, names: Sequence[str], values: Sequence[Any]):
        self._names = {name: i for i, name in enumerate(names)}
        self._values = list(values)

    def __getattr__(self, name: str) -> Any:
        try:
            return self._values[self._names[name]]
        except KeyError:
            raise AttributeError(f"no name '{name}': expected one of {', '.join(self._names)}") from None

    def __getitem__(self, index: int) -> Any:
        return self._values[index]

    def __iter__(self) -> Iterator[Any]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)


@dataclass(frozen=True)
class Observable:
    """A scalar functional of a solution with an exact gradient: see :func:`integral_of` and :func:`end_value`."""

    kind: str
    function: Callable[..., Any]

    def __post_init__(self) -> None:
        _check_function("function", self.function)


def _check_function(field: str, value: object) -> None:
    if not callable(value):
        raise ValueError(f"{field}: expected a function, got {value!r}")


def integral_of(function: Callable[[Any, Any, Any], Any]) -> Observable:
    r"""Observable :math:`\int_0^1 g(s, u, p)\,ds`."""
    return Observable("integral", function)


def end_value(function: Callable[[Any, Any, Any], Any]) -> Observable:
    """Observable `g(left, right, p)` of the two end states."""
    return Observable("end", function)


@dataclass(frozen=True)
class Traced:
    """CasADi functions of one problem; each is evaluated at many points by

    `field`: (s, u, p) -> f (n,), nonzeros of f_u (nnz,), f_p (n, np) column-major.
    `field_second`: (s, u, p, v, vp, w) -> gradients in u and p of w.(f_u v + f_p vp).
    `ends`, `ends_second`: the same for b(u0, u1, p), with u = (u0, u1).
    `densities`, `densities_second`: the same for the integrands, dense.
    `identities`: (u, p) -> what vanishes along every solution, and both derivatives; None where nothing is declared.
    """

    field: Any
    field_second: Any
    ends: Any
    ends_second: Any
    densities: Any
    densities_second: Any
    identities: Any = None


class BVP:
    r"""A two-point boundary value problem on :math:`0 \le s \le 1`.

    .. math:: u' = f(s, u, p), \qquad b(u(0), u(1), p) = 0, \qquad \int_0^1 g(s, u, p)\,ds = 0

    Parameters
    ----------
    rhs : callable
        `rhs(s, u, p)` returns the n derivatives, as a sequence in the order of `unknowns` or as a mapping by
        name. It is written in ordinary Python with NumPy functions and is called once, with symbols.
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

    Raises
    ------
    ValueError
        when a function cannot be traced with symbols (`if`, `math.sin`), returns something else than numbers and
        expressions, or the wrong number of them, or depends on something that is not an argument; when there are
        fewer conditions than unknowns, or more than the parameters can meet; when a declared symmetry is none.

    Notes
    -----
    The problem has n_b + n_i - n + 1 free parameters on a branch: conditions minus unknowns, plus one.
    """

    def __init__(
        self,
        rhs: Callable[[Any, Any, Any], Any],
        boundary: Callable[[Any, Any, Any], Any],
        integrals: Callable[..., Any] | Sequence[Callable[..., Any]] = (),
        *,
        unknowns: Sequence[str],
        parameters: Mapping[str, float] | None = None,
        observables: Mapping[str, Observable] | None = None,
        scales: Mapping[str, float] | None = None,
        symmetries: Sequence[Symmetry | ContinuousSymmetry] = (),
        identities: Callable[[Any, Any], Any] | None = None,
        name: str = "bvp",
    ):
        self.name = name
        self.unknowns = _names("unknowns", unknowns)
        self.parameters = _numbers("parameters", {} if parameters is None else parameters)
        self.observables = dict(observables or {})
        self.scales = _numbers("scales", scales or {})
        _check_names(self.unknowns, self.parameters, self.observables, self.scales)
        self._rhs, self._boundary = rhs, boundary
        self._integrals = (integrals,) if callable(integrals) else tuple(integrals or ())
        _check_functions(self._rhs, self._boundary, self._integrals, self.observables)
        self._identities, self._symmetries = identities, tuple(symmetries)
        self._trace()
        check_names(self._symmetries)
        self.symmetries, self.gauges = checked(self, [x for x in self._symmetries if isinstance(x, Symmetry)])
        self.generators: tuple[Generator, ...] = generators(
            self, [x for x in self._symmetries if isinstance(x, ContinuousSymmetry)]
        )
        self.phases, self.unfoldings, self.plain = 0, 0, self
        self._unfolded: dict[tuple[int, int], BVP] = {}

    def __repr__(self) -> str:
        return (
            f"BVP({self.name}: {self.size} unknowns, {self.n_boundary} boundary and {self.n_integral} integral "
            f"conditions, {self.n_free} free parameter{'s' if self.n_free != 1 else ''})"
        )

    @property
    def size(self) -> int:
        return len(self.unknowns)

    @property
    def n_free(self) -> int:
        """Number of free parameters along a branch."""
        return self.n_boundary + self.n_integral - self.size + 1

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(self.parameters)

    def parameter_index(self, name: str) -> int:
        if name not in self.parameters:
            raise ValueError(f"parameter: expected one of {', '.join(self.parameters)}, got '{name}'")
        return self.parameter_names.index(name)

    def parameter_vector(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """Values of all parameters (np,), the defaults overridden by `values`."""
        merged = dict(self.parameters)
        for key, value in (values or {}).items():
            self.parameter_index(key)
            merged[key] = _number("parameters", key, value)
        return np.array(list(merged.values()), dtype=float)

    def with_parameter(self, name: str) -> BVP:
        """The same problem with one more parameter, zero and without effect."""
        return BVP(
            self._rhs, self._boundary, self._integrals, unknowns=self.unknowns,
            parameters={**self.parameters, name: 0.0}, observables=self.observables, scales=self.scales,
            symmetries=self._symmetries, identities=self._identities, name=self.name,
        )  # fmt: skip

    def unfolded(self, phases: int, unfoldings: int) -> BVP:
        """The same problem with room for phase conditions, and for unfolding parameters.

        Both are empty here. :class:`rodatlas.continuation.discrete.phase.Phase` fills them on a mesh.
        """
        if phases == 0:
            return self
        if (phases, unfoldings) not in self._unfolded:
            new = BVP(
                self._rhs, self._boundary, (*self._integrals, lambda s, u, p: [0.0] * phases), unknowns=self.unknowns,
                parameters={**self.parameters, **{f"unfolding_of_phase_{i + 1}": 0.0 for i in range(unfoldings)}},
                observables=self.observables, scales=self.scales, identities=self._identities, name=self.name,
            )  # fmt: skip
            new.symmetries = {name: widened(action, unfoldings) for name, action in self.symmetries.items()}
            new.gauges = tuple(widened(action, unfoldings) for action in self.gauges)
            new.generators, new.plain = self.generators, self
            new.phases, new.unfoldings = phases, unfoldings
            self._unfolded[phases, unfoldings] = new
        return self._unfolded[phases, unfoldings]

    @cached_property
    def own_parameters(self) -> tuple[str, ...]:
        """Names of the parameters without those that unfold phase conditions, which come last."""
        return self.parameter_names[: len(self.parameters) - self.unfoldings]

    def traced_function(self, function: Callable[..., Any], field: str, names: Sequence[str]) -> Any:
        """A function(s, u, p) of a user, one value for each name, as a CasADi function (s, u, p) -> (len(names),)."""
        import casadi as ca

        with _numpy_semantics(ca):
            s, u, p = ca.SX.sym("s"), ca.SX.sym("u", self.size), ca.SX.sym("p", len(self.parameters))
            un, pn = Named(self.unknowns, ca.vertsplit(u)), Named(self.parameter_names, ca.vertsplit(p))
            column = _Tracer(ca, (s, u, p), (s, un, pn)).column(function, field, names) if names else ca.SX(0, 1)
        return _function(ca, "traced", [s, u, p], [ca.densify(column)])

    def _trace(self) -> None:
        import casadi as ca

        with _numpy_semantics(ca):
            s = ca.SX.sym("s")
            u, left, right = (ca.SX.sym(k, self.size) for k in ("u", "u0", "u1"))
            p = ca.SX.sym("p", len(self.parameters))
            pn = Named(self.parameter_names, ca.vertsplit(p))
            un, ln, rn = (Named(self.unknowns, ca.vertsplit(x)) for x in (u, left, right))
            inside, ends = _Tracer(ca, (s, u, p), (s, un, pn)), _Tracer(ca, (left, right, p), (ln, rn, pn))
            f = inside.column(self._rhs, "rhs", self.unknowns)
            b = ends.column(self._boundary, "boundary")
            g = [inside.column(fun, "integrals") for fun in self._integrals]
            g_all = ca.vertcat(*g) if g else ca.SX(0, 1)
            self.n_boundary, self.n_integral = b.numel(), g_all.numel()
            same = _Tracer(ca, (u, p), (un, pn)).column(self._identities, "identities") if self._identities else None
            for key, obs in self.observables.items():
                if obs.kind == "integral":
                    g_all = ca.vertcat(g_all, inside.column(obs.function, f"observable {key}", (key,)))
                else:
                    b = ca.vertcat(b, ends.column(obs.function, f"observable {key}", (key,)))
        self._check_count()
        both = ca.vertcat(left, right)
        jac = ca.jacobian(f, u)
        self.sparsity = strong_components(self.size, *_pattern(jac))
        entries: Any = jac.nonzeros()
        nonzeros = ca.vertcat(*entries) if jac.nnz() else ca.SX(0, 1)
        self.traced = Traced(
            field=_function(ca, "field", [s, u, p], [f, nonzeros, ca.densify(ca.jacobian(f, p))]),
            field_second=_second(ca, "field_second", [s, u, p], f, u, p),
            ends=_function(
                ca, "ends", [both, p], [b, ca.densify(ca.jacobian(b, both)), ca.densify(ca.jacobian(b, p))]
            ),
            ends_second=_second(ca, "ends_second", [both, p], b, both, p),
            densities=_function(
                ca, "densities", [s, u, p],
                [g_all, ca.densify(ca.jacobian(g_all, u)), ca.densify(ca.jacobian(g_all, p))],
            ),
            densities_second=_second(ca, "densities_second", [s, u, p], g_all, u, p),
            identities=same if same is None else _function(
                ca, "identities", [u, p], [same, ca.densify(ca.jacobian(same, u)), ca.densify(ca.jacobian(same, p))]
            ),
        )  # fmt: skip

    def _check_count(self) -> None:
        """A branch needs a free parameter, and no more of them than the problem has."""
        fewest = self.size - self.n_integral
        most = fewest + max(0, len(self.parameters) - 1)
        with_integrals = f" and {self.n_integral} integral conditions" if self.n_integral else ""
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
        """Place of each observable: ('integral' or 'end', row behind the conditions of that kind)."""
        slots, count = {}, {"integral": self.n_integral, "end": self.n_boundary}
        for key, obs in self.observables.items():
            slots[key] = (obs.kind, count[obs.kind])
            count[obs.kind] += 1
        return slots


class _numpy_semantics:
    """Ask CasADi (3.8 and later) for NumPy semantics while a user's functions run, then restore its setting."""

    def __init__(self, ca: Any):
        self._options = ca.GlobalOptions

    def __enter__(self) -> None:
        self._old = getattr(self._options, "getNumpyMode", lambda: None)()
        if hasattr(self._options, "setNumpyMode"):
            self._options.setNumpyMode(1)

    def __exit__(self, *_: object) -> None:
        if self._old is not None:
            self._options.setNumpyMode(self._old)


def _names(field: str, names: Any) -> tuple[str, ...]:
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{field}: expected a sequence of names such as ('u', 'v'), got {names!r}")
    return tuple(names)


def _numbers(field: str, values: Any) -> dict[str, float]:
    if not isinstance(values, Mapping):
        raise ValueError(f"{field}: expected a mapping of names to numbers, got {values!r}")
    return {name: _number(field, name, values[name]) for name in _names(field, values)}


def _number(field: str, name: str, value: Any) -> float:
    try:
        number = float("nan") if isinstance(value, str) else float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not math.isfinite(number):
        raise ValueError(f"{field}: expected a finite number for '{name}', got {value!r}")
    return number


def _check_names(
    unknowns: Sequence[str],
    parameters: Mapping[str, float],
    observables: Mapping[str, Observable],
    scales: Mapping[str, float],
) -> None:
    if not unknowns:
        raise ValueError("unknowns: expected at least one name, got none")
    names = [*unknowns, *parameters]
    for name in (everything := [*names, *observables]):
        if not name.isidentifier() or everything.count(name) > 1:
            raise ValueError(f"unknowns, parameters, observables: expected distinct identifiers, got '{name}'")
    for name, value in scales.items():
        if name not in names:
            raise ValueError(f"scales: expected one of {', '.join(names)}, got '{name}'")
        if value <= 0:
            raise ValueError(f"scales: expected a positive number for '{name}', got {value}")


def _check_functions(rhs: Any, boundary: Any, integrals: Sequence[Any], observables: Mapping[str, Any]) -> None:
    for field, function in (("rhs", rhs), ("boundary", boundary), *(("integrals", g) for g in integrals)):
        _check_function(field, function)
    for name, observable in observables.items():
        if not isinstance(observable, Observable):
            raise ValueError(
                f"observables: expected integral_of(function) or end_value(function) for '{name}', got {observable!r}"
            )


class _Tracer:
    """Calls a user's functions with symbols and checks what they return.

    Parameters
    ----------
    symbols : what the result may depend on; arguments : the same, reachable by name.
    """

    def __init__(self, ca: Any, symbols: tuple[Any, ...], arguments: tuple[Any, ...]):
        self._ca, self._symbols, self._arguments = ca, symbols, arguments

    def column(self, function: Callable[..., Any], field: str, names: Sequence[str] | None = None) -> Any:
        """What `function` returns as a column of SX, one entry per name where names are given."""
        expected = "numbers and expressions" if names is None else f"{len(names)} values, one per unknown"
        if field.startswith("observable "):
            expected = "one value"
        try:
            values = function(*self._arguments)
        except (TypeError, NotImplementedError, RuntimeError) as error:
            raise ValueError(_why_untraceable(field, error)) from error
        if values is None:
            raise ValueError(f"{field}: expected {expected}, got None: does the function return what it computes?")
        if isinstance(values, Mapping):
            if names is None or set(values) != set(names):
                wanted = "a sequence" if names is None else f"the names {names}"
                raise ValueError(f"{field}: expected {wanted}, got {sorted(values)}")
            values = [values[k] for k in names]
        elif isinstance(values, np.ndarray):
            values = list(values.ravel())
        elif isinstance(values, Named):
            values = list(values)
        elif not isinstance(values, (list, tuple)):
            values = [values]
        column = self._ca.vertcat(*[self._entry(v, field, i) for i, v in enumerate(values)])
        if names is not None and column.numel() != len(names):
            raise ValueError(f"{field}: expected {expected}, got {column.numel()}")
        self._check(column, field)
        return column

    def _entry(self, value: Any, field: str, place: int) -> Any:
        """One returned value as a column of SX (usually of length one)."""
        ca = self._ca
        if isinstance(value, np.ndarray) and value.size == 1:
            value = value.ravel()[0]
        if isinstance(value, (numbers.Real, np.bool_)):
            return ca.SX(float(value))
        try:
            if not isinstance(value, (list, tuple, np.ndarray)):
                return ca.vec(ca.SX(value))  # SX, DM, and what NumPy functions make of them
        except (NotImplementedError, TypeError):
            pass
        got = f"the {type(value).__name__} {value!r} as value {place + 1}".replace("\n", " ")
        raise ValueError(f"{field}: expected real numbers and expressions in one flat sequence, got {got}")

    def _check(self, column: Any, field: str) -> None:
        """Refuse symbols from elsewhere, and the NaN that `math` functions make of a symbol."""
        ca = self._ca
        function = ca.Function("checked", [ca.vertcat(*self._symbols)], [column], {"allow_free": True})
        if strangers := function.get_free():
            raise ValueError(f"{field}: expected functions of the given symbols only, got {', '.join(strangers)} too")
        constants = (k for k in range(function.n_instructions()) if function.instruction_id(k) == ca.OP_CONST)
        if any(math.isnan(function.instruction_constant(k)) for k in constants):
            raise ValueError(
                f"{field}: expected functions of the given symbols, got the constant NaN: float(), math.sin and the "
                "like make it of a symbol, so write np.sin and leave out float()"
            )


def _why_untraceable(field: str, error: Exception) -> str:
    """One line that says how to write a function which symbols cannot pass through."""
    if "truth value" in str(error):
        return (
            f"{field}: expected expressions without `if`, `and`, `max` or a comparison used as a truth value, because "
            "the function is called once with symbols: write np.where(condition, a, b) "
            "(casadi.if_else before CasADi 3.8), np.minimum or np.maximum"
        )
    first = (str(error).strip().splitlines() or [""])[0]
    return f"{field}: expected arithmetic and NumPy functions of the arguments, got {type(error).__name__}: {first}"


def _function(ca: Any, name: str, inputs: list[Any], outputs: list[Any]) -> Any:
    try:
        return ca.Function(name, inputs, outputs)
    except RuntimeError as error:
        raise ValueError(f"{name}: expected functions of the given symbols only, got: {error}") from None


def _second(ca: Any, name: str, inputs: list[Any], f: Any, u: Any, p: Any) -> Any:
    """Gradient in (u, p) of w.(f_u v + f_p vp), for minimally augmented systems."""
    v, vp, w = ca.SX.sym("v", u.numel()), ca.SX.sym("vp", p.numel()), ca.SX.sym("w", f.numel())
    first = ca.dot(w, ca.jtimes(f, u, v) + ca.jtimes(f, p, vp)) if f.numel() else ca.SX(0)
    return _function(
        ca, name, [*inputs, v, vp, w], [ca.densify(ca.gradient(first, u)), ca.densify(ca.gradient(first, p))]
    )


def _pattern(jac: Any) -> tuple[np.ndarray, np.ndarray]:
    rows, cols = jac.sparsity().get_triplet()
    return np.array(rows, dtype=np.int64), np.array(cols, dtype=np.int64)
