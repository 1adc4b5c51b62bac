"""The continuous problem: a two-point boundary value problem traced once into exact derivatives."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rodatlas.continuation.sparsity import strong_components


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


def integral_of(function: Callable[[Any, Any, Any], Any]) -> Observable:
    r"""Observable :math:`\int_0^1 g(s, u, p)\,ds`."""
    return Observable("integral", function)


def end_value(function: Callable[[Any, Any, Any], Any]) -> Observable:
    """Observable `g(left, right, p)` of the two end states."""
    return Observable("end", function)


@dataclass(frozen=True)
class Traced:
    """CasADi functions of one problem; each is evaluated at many points by :class:`Evaluator`.

    `field`: (s, u, p) -> f (n,), nonzeros of f_u (nnz,), f_p (n, np) column-major.
    `field_second`: (s, u, p, v, vp, w) -> gradients in u and p of w.(f_u v + f_p vp).
    `ends`, `ends_second`: the same for b(u0, u1, p), with u = (u0, u1).
    `densities`, `densities_second`: the same for the integrands, dense.
    """

    field: Any
    field_second: Any
    ends: Any
    ends_second: Any
    densities: Any
    densities_second: Any


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
        names and default values of the scalars p.
    observables : mapping of str to Observable
        functionals that are recorded along branches and can be used as events.
    scales : mapping of str to float
        typical size of unknowns and parameters; it enters the arclength norm. Missing unknowns are scaled by
        the first solution of a run, missing parameters by one.

    Raises
    ------
    ValueError
        when a function returns the wrong number of values or depends on something that is not an argument.

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
        parameters: Mapping[str, float],
        observables: Mapping[str, Observable] | None = None,
        scales: Mapping[str, float] | None = None,
        name: str = "bvp",
    ):
        self.name = name
        self.unknowns = tuple(unknowns)
        self.parameters = {key: float(value) for key, value in parameters.items()}
        self.observables = dict(observables or {})
        self.scales = dict(scales or {})
        _check_names(self.unknowns, self.parameters, self.observables, self.scales)
        self._rhs, self._boundary = rhs, boundary
        self._integrals = (integrals,) if callable(integrals) else tuple(integrals)
        self._trace()

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
            merged[key] = float(value)
        return np.array(list(merged.values()), dtype=float)

    def _trace(self) -> None:
        import casadi as ca

        with _numpy_semantics(ca):
            s = ca.SX.sym("s")
            u, left, right = (ca.SX.sym(k, self.size) for k in ("u", "u0", "u1"))
            p = ca.SX.sym("p", len(self.parameters))
            pn = Named(self.parameter_names, ca.vertsplit(p))
            un, ln, rn = (Named(self.unknowns, ca.vertsplit(x)) for x in (u, left, right))
            f = _column(ca, self._rhs(s, un, pn), "rhs", self.unknowns)
            b = _column(ca, self._boundary(ln, rn, pn), "boundary")
            g = [_column(ca, fun(s, un, pn), "integrals") for fun in self._integrals]
            g_all = ca.vertcat(*g) if g else ca.SX(0, 1)
            self.n_boundary, self.n_integral = b.numel(), g_all.numel()
            for key, obs in self.observables.items():
                if obs.kind == "integral":
                    g_all = ca.vertcat(g_all, _column(ca, obs.function(s, un, pn), f"observable {key}"))
                else:
                    b = ca.vertcat(b, _column(ca, obs.function(ln, rn, pn), f"observable {key}"))
        ends = ca.vertcat(left, right)
        jac = ca.jacobian(f, u)
        self.sparsity = strong_components(self.size, *_pattern(jac))
        entries: Any = jac.nonzeros()
        nonzeros = ca.vertcat(*entries) if jac.nnz() else ca.SX(0, 1)
        self.traced = Traced(
            field=_function(ca, "field", [s, u, p], [f, nonzeros, ca.densify(ca.jacobian(f, p))]),
            field_second=_second(ca, "field_second", [s, u, p], f, u, p),
            ends=_function(
                ca, "ends", [ends, p], [b, ca.densify(ca.jacobian(b, ends)), ca.densify(ca.jacobian(b, p))]
            ),
            ends_second=_second(ca, "ends_second", [ends, p], b, ends, p),
            densities=_function(
                ca, "densities", [s, u, p],
                [g_all, ca.densify(ca.jacobian(g_all, u)), ca.densify(ca.jacobian(g_all, p))],
            ),
            densities_second=_second(ca, "densities_second", [s, u, p], g_all, u, p),
        )
        if self.n_free < 1:
            raise ValueError(
                f"boundary: expected at least {self.size - self.n_integral} conditions for {self.size} unknowns, "
                f"got {self.n_boundary}"
            )

    def observable_slots(self) -> dict[str, tuple[str, int]]:
        """Place of each observable: ('integral' or 'end', row behind the conditions of that kind)."""
        slots, count = {}, {"integral": self.n_integral, "end": self.n_boundary}
        for key, obs in self.observables.items():
            slots[key] = (obs.kind, count[obs.kind])
            count[obs.kind] += 1
        return slots


class Evaluator:
    """Evaluates one traced function at `count` points through CasADi's copy-free buffers.

    Inputs and outputs are NumPy arrays with the point as first axis (an input without it is repeated); matrices
    come transposed (column-major per point). The output arrays belong to the evaluator and are overwritten by the
    next call.
    """

    def __init__(self, function: Any, count: int):
        self._buffer, self._call = _mapped(function, count).buffer()
        self._inputs = [np.zeros((count, function.numel_in(i))) for i in range(function.n_in())]
        self.outputs = [np.zeros((count, function.numel_out(i))) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, array.data)

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        for array, value in zip(self._inputs, arguments, strict=True):
            array[...] = value.reshape(array.shape) if value.size == array.size else value
        self._call()
        return self.outputs


@lru_cache(maxsize=256)
def _mapped(function: Any, count: int) -> Any:
    """The function over `count` points; meshes of equal size share it."""
    return function if count == 1 else function.map(count)


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


def _check_names(
    unknowns: Sequence[str],
    parameters: Mapping[str, float],
    observables: Mapping[str, Observable],
    scales: Mapping[str, float],
) -> None:
    if not unknowns:
        raise ValueError("unknowns: expected at least one name, got none")
    if not parameters:
        raise ValueError("parameters: expected at least one name and value, got none")
    names = [*unknowns, *parameters]
    for name in (everything := [*names, *observables]):
        if not name.isidentifier() or everything.count(name) > 1:
            raise ValueError(f"unknowns, parameters, observables: expected distinct identifiers, got '{name}'")
    for name, value in scales.items():
        if name not in names:
            raise ValueError(f"scales: expected one of {', '.join(names)}, got '{name}'")
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"scales: expected a positive number for '{name}', got {value}")


def _column(ca: Any, values: Any, field: str, names: Sequence[str] | None = None) -> Any:
    """Flatten what a user's function returned into a column of SX, checking its length and names."""
    if isinstance(values, Mapping):
        if names is None or set(values) != set(names):
            raise ValueError(f"{field}: expected the names {names}, got {sorted(values)}")
        values = [values[k] for k in names]
    elif isinstance(values, np.ndarray):
        values = list(values.ravel())
    elif not isinstance(values, (list, tuple)):
        values = [values]
    column = ca.vertcat(*[ca.SX(v) for v in values])
    if names is not None and column.numel() != len(names):
        raise ValueError(f"{field}: expected {len(names)} values, one per unknown, got {column.numel()}")
    return column


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
