"""Functions for use in a problem that NumPy alone does not offer: tables that trace, and the error function.

They take numbers, arrays, and the symbols with which a problem's functions are called.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rodatlas.continuation.checks import as_array, check_flag, shown

KINDS = ("cubic", "linear")
SLACK = 1e-9  # of the table's width: places this far outside are round-off


class Tabulated:
    """A function through given points; see :func:`tabulated`.

    Attributes
    ----------
    knots : (N,) where pieces meet; give the inner ones as `breakpoints` if the argument is s itself.
    """

    def __init__(self, x: np.ndarray, coefficients: np.ndarray, kind: str, extend: bool):
        self.knots, self._coefficients, self._kind, self._extend = x, coefficients, kind, extend

    def __repr__(self) -> str:
        return f"Tabulated({self._kind}, {len(self.knots)} points from {self.knots[0]:g} to {self.knots[-1]:g})"

    def __call__(self, x: Any) -> Any:
        """Values at numbers, or an expression of a symbol; infinite outside, unless the table is extended."""
        if isinstance(x, (int, float, np.ndarray, np.number, list, tuple)):
            return self._at_numbers(np.asarray(x, dtype=float))
        return self._expression(x)

    def _limits(self) -> tuple[float, float]:
        slack = SLACK * (self.knots[-1] - self.knots[0])
        return float(self.knots[0] - slack), float(self.knots[-1] + slack)

    def _at_numbers(self, x: np.ndarray) -> Any:
        piece = np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.knots) - 2)
        value = _horner(self._coefficients[:, piece], x - self.knots[piece])
        low, high = self._limits()
        value = value if self._extend else np.where((x < low) | (x > high), np.inf, value)
        return value if value.ndim else float(value)

    def _expression(self, x: Any) -> Any:
        """The polynomial whose coefficients are picked by comparisons, so that derivatives are those of one piece."""
        import casadi as ca

        chosen = [ca.SX(float(v)) for v in (self.knots[0], *self._coefficients[:, 0])]
        for i, knot in enumerate(self.knots[1:-1], start=1):
            behind = x >= float(knot)
            new = (knot, *self._coefficients[:, i])
            chosen = [ca.if_else(behind, float(v), old) for v, old in zip(new, chosen, strict=True)]
        value = _horner(chosen[1:], x - chosen[0])
        low, high = self._limits()
        return value if self._extend else ca.if_else(ca.logic_and(x >= low, x <= high), value, float("inf"))


def _horner(coefficients: Any, t: Any) -> Any:
    value = coefficients[0]
    for c in coefficients[1:]:
        value = value * t + c
    return value


def tabulated(x: Any, y: Any, kind: str = "cubic", extend: bool = False) -> Tabulated:
    """A function through points (x, y), for use in a problem on symbols as on numbers.

    Parameters
    ----------
    x : (N,) increasing places; y : (N,) values.
    kind : 'cubic', a spline with two continuous derivatives (not-a-knot at its ends), or 'linear'. Second derivatives
        of a problem enter at folds and branch points, so a law of the unknowns should be cubic.
    extend : continue the first and the last piece outside of the table. Otherwise it is infinite there, and a run
        that leads outside ends and says so.

    Raises
    ------
    ValueError
        when x does not increase, or lengths differ, or something is not finite.

    Examples
    --------
    >>> stiffness = tabulated([0.0, 0.3, 0.7, 1.0], [1.0, 1.4, 1.1, 1.0])
    >>> column = BVP(lambda s, u, p: [u.t, -p.P * np.sin(u.y) / stiffness(s)], ...)
    """
    check_flag("extend", extend)
    if kind not in KINDS:
        raise ValueError(f"kind: expected one of {KINDS}, got {kind!r}")
    at, values = _column("x", x), _column("y", y)
    if len(at) != len(values):
        raise ValueError(f"y: expected {len(at)} values, one for each x, got {len(values)}")
    fewest = 4 if kind == "cubic" else 2
    if len(at) < fewest or not (np.diff(at) > 0).all():
        raise ValueError(f"x: expected at least {fewest} strictly increasing numbers, got {len(at)}")
    if kind == "linear":
        coefficients = np.stack([np.diff(values) / np.diff(at), values[:-1]])
    else:
        from scipy.interpolate import CubicSpline

        coefficients = CubicSpline(at, values).c
    return Tabulated(at, coefficients, kind, extend)


def _column(field: str, values: Any) -> np.ndarray:
    try:
        column = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"{field}: expected a sequence of numbers, got {shown(values)}") from None
    if column.ndim != 1 or not np.isfinite(column).all():
        raise ValueError(f"{field}: expected finite numbers in one sequence, got an array of shape {column.shape}")
    return column


def erf(x: Any) -> Any:
    r"""Error function :math:`\tfrac{2}{\sqrt\pi}\int_0^x e^{-t^2}\,dt` of numbers, arrays or symbols.

    NumPy has none, and that of SciPy refuses symbols.

    Examples
    --------
    >>> smooth_step = 0.5 * (1 + erf((s - 0.3) / p.width))
    """
    if isinstance(x, (int, float, np.ndarray, np.number, list, tuple)):
        from scipy.special import erf as of_numbers

        return of_numbers(as_array("x", x))
    import casadi as ca

    if not isinstance(x, (ca.SX, ca.MX, ca.DM)):
        raise ValueError(f"x: expected a number, an array or a symbol, got {shown(x)}")
    return ca.erf(x)
