"""Calling a user's functions once, with symbols, and what CasADi makes of the results."""

from __future__ import annotations

import math
import numbers
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

INSTEAD = "`erf` and `tabulated` of this package take symbols"


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


class numpy_semantics:
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


class Tracer:
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
        if names is not None and len(names) == 1 and field != "rhs":
            expected = "one value"
        try:
            values = function(*self._arguments)
        except (TypeError, AttributeError, LookupError, NotImplementedError, RuntimeError) as error:
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
                f"like make it of a symbol, so write np.sin and leave out float(); {INSTEAD}"
            )


def _why_untraceable(field: str, error: Exception) -> str:
    """One line that says how to write a function which symbols cannot pass through."""
    if "truth value" in str(error):
        return (
            f"{field}: expected expressions without `if`, `and`, `max` or a comparison used as a truth value, because "
            "the function is called once with symbols: write np.where(condition, a, b) "
            "(casadi.if_else before CasADi 3.8), np.minimum or np.maximum"
        )
    refused = re.search(r"<ufunc '(\w+)'>", str(error))
    if refused and not hasattr(np, refused[1]):
        return f"{field}: expected arithmetic and NumPy functions of the arguments, got SciPy's {refused[1]}: {INSTEAD}"
    first = (str(error).strip().splitlines() or [""])[0]
    return f"{field}: expected arithmetic and NumPy functions of the arguments, got {type(error).__name__}: {first}"


def function_of(ca: Any, name: str, inputs: list[Any], outputs: list[Any]) -> Any:
    try:
        return ca.Function(name, inputs, outputs)
    except RuntimeError as error:
        raise ValueError(f"{name}: expected functions of the given symbols only, got: {error}") from None


def second_of(ca: Any, inputs: list[Any], f: Any, u: Any, p: Any) -> tuple[list[Any], list[Any]]:
    """Inputs (..., v, vp, w), and gradients in u and p of w.(f_u v + f_p vp), for minimally augmented systems."""
    v, vp, w = ca.SX.sym("v", u.numel()), ca.SX.sym("vp", p.numel()), ca.SX.sym("w", f.numel())
    first = ca.dot(w, ca.jtimes(f, u, v) + ca.jtimes(f, p, vp)) if f.numel() else ca.SX(0)
    return [*inputs, v, vp, w], [ca.densify(ca.gradient(first, u)), ca.densify(ca.gradient(first, p))]


def pattern_of(sparsity: Any) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the nonzeros."""
    rows, cols = sparsity.get_triplet()
    return np.array(rows, dtype=np.int64), np.array(cols, dtype=np.int64)
