"""Symmetries of a boundary value problem, declared by name and checked when the problem is built.

A symmetry maps solutions to solutions: (u, p)(s) -> (S u(r) + C p + c, T p + t) with r = s or r = 1 - s.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from rodatlas.continuation.checks import as_finite, check_flag, check_type, shown
from rodatlas.continuation.problem.evaluator import Evaluator

if TYPE_CHECKING:
    from rodatlas.continuation.problem.bvp import BVP

LARGEST_ORDER = 24
SAMPLES = 5
TOLERANCE = 1e-8

Map = Mapping[str, "float | str"] | np.ndarray


class NotRespected(ValueError):
    """A declared symmetry is none of the problem's."""


@dataclass(frozen=True, eq=False)
class Symmetry:
    """Declaration of one symmetry.

    Parameters
    ----------
    name : how it is called.
    unknowns : what each unknown becomes: a factor (`{"y": -1}`), or an affine expression of unknowns and parameters
        (`{"x": "1 - d - x", "q0": "q2"}`). What is missing stays. Or a matrix (n, n).
    parameters : the same for parameters, in terms of parameters only; or a matrix (np, np).
    reverse : whether s becomes 1 - s as well.
    gauge : the two describe one state (q and -q one rotation). A gauge respects the equations and not the boundary
        conditions; images under the other symmetries satisfy these up to a gauge. It is never reported itself.
    """

    name: str
    unknowns: Map = field(default_factory=dict)
    parameters: Map = field(default_factory=dict)
    reverse: bool = False
    gauge: bool = False

    def __post_init__(self) -> None:
        check_type("symmetries", self.name, str, "a name")
        for name in ("unknowns", "parameters"):
            what = f"the {name} and what they become, such as {{'y': -1}}, or a matrix"
            check_type(f"symmetries: '{self.name}'", getattr(self, name), (Mapping, np.ndarray), what)
        for name in ("reverse", "gauge"):
            check_flag(f"symmetries: '{self.name}': {name}", getattr(self, name))

    def bind(self, unknowns: Sequence[str], parameters: Sequence[str]) -> Action:
        """The map as a matrix for these names; ValueError when it does not fit them."""
        n, k = len(unknowns), len(parameters)
        matrix = np.eye(n + k + 1)
        matrix[:n] = self._rows("unknowns", self.unknowns, [*unknowns, *parameters], 0, n)
        matrix[n:-1, n:] = self._rows("parameters", self.parameters, parameters, 0, k)
        action = Action(self.name, matrix, n, self.reverse)
        if action.order > LARGEST_ORDER:
            raise ValueError(
                f"symmetries: expected '{self.name}' to give back the same after at most {LARGEST_ORDER} applications"
            )
        return action

    def _rows(self, what: str, given: Map, names: Sequence[str], start: int, count: int) -> np.ndarray:
        """Rows (count, len(names) + 1) of coefficients and constants."""
        rows = np.eye(len(names) + 1)[start : start + count]
        if isinstance(given, np.ndarray):
            if given.shape != (count, count):
                raise ValueError(
                    f"symmetries: '{self.name}': expected {what} of shape {(count, count)}, got {given.shape}"
                )
            try:
                rows[:, :count] = given
            except (TypeError, ValueError):
                rows[:, :count] = np.nan
            if not np.isfinite(rows).all():
                raise ValueError(f"symmetries: '{self.name}': expected {what} as finite numbers, got {shown(given)}")
            return rows
        known = list(names[:count])
        for name, value in given.items():
            if name not in known:
                raise ValueError(f"symmetries: '{self.name}': expected {what} among {', '.join(known)}, got '{name}'")
            i = known.index(name)
            try:
                if isinstance(value, str):
                    rows[i] = _affine(value, names)
                else:
                    rows[i] *= as_finite("factor", name, value)
            except (ValueError, ZeroDivisionError, OverflowError) as error:
                raise ValueError(f"symmetries: '{self.name}', {name}: {error}") from None
        return rows


@dataclass(frozen=True, eq=False)
class Action:
    """A symmetry bound to a problem: (u, p, 1) -> matrix (u, p, 1), with s -> 1 - s when `reverse`.

    Attributes
    ----------
    matrix : (n + np + 1, n + np + 1); size : n.
    """

    name: str
    matrix: np.ndarray
    size: int
    reverse: bool = False

    def __repr__(self) -> str:
        return f"Action({self.name}{', reversed' if self.reverse else ''}, order {self.order})"

    def __matmul__(self, first: Action) -> Action:
        """The other one first, then this one."""
        name, reverse = f"{self.name} * {first.name}", self.reverse != first.reverse
        return Action(name, self.matrix @ first.matrix, self.size, reverse)

    @property
    def order(self) -> int:
        """Applications after which everything is as before; one more than the largest allowed when there are none."""
        power = self
        for order in range(1, LARGEST_ORDER + 1):
            if power.is_identity:
                return order
            power = power @ self
        return LARGEST_ORDER + 1

    @property
    def is_identity(self) -> bool:
        return not self.reverse and bool(np.abs(self.matrix - np.eye(len(self.matrix))).max() < 1e-9)

    def unknowns(self, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Images of unknowns (..., n) at parameters (np,) or (..., np); the argument s is the caller's."""
        n = self.size
        return u @ self.matrix[:n, :n].T + p @ self.matrix[:n, n:-1].T + self.matrix[:n, -1]

    def parameters(self, p: np.ndarray) -> np.ndarray:
        """Images of parameters (..., np)."""
        n = self.size
        return p @ self.matrix[n:-1, n:-1].T + self.matrix[n:-1, -1]


def check_names(symmetries: Sequence[Any]) -> None:
    """Raise ValueError unless symmetries of any kind have names of their own."""
    if not isinstance(symmetries, Sequence):
        raise ValueError(f"symmetries: expected a sequence of them, got {shown(symmetries)}")
    if strangers := [x for x in symmetries if not hasattr(x, "name")]:
        raise ValueError(f"symmetries: expected Symmetry and ContinuousSymmetry objects, got {shown(strangers[0])}")
    names = [x.name for x in symmetries]
    for name in names:
        if names.count(name) > 1 or not name or "*" in name:
            raise ValueError(f"symmetries: expected distinct names without '*', got '{name}'")


def widened(action: Action, more: int) -> Action:
    """The action on a problem with more parameters at the end, which it leaves alone."""
    old = len(action.matrix) - 1
    matrix = np.eye(old + more + 1)
    kept = [*range(old), old + more]
    matrix[np.ix_(kept, kept)] = action.matrix
    return Action(action.name, matrix, action.size, action.reverse)


def checked(bvp: BVP, symmetries: Sequence[Symmetry]) -> tuple[dict[str, Action], tuple[Action, ...]]:
    """The symmetries of a problem by name, and its gauges, each tested at random points.

    Raises
    ------
    ValueError
        naming the symmetry and what it does not respect: an equation, the boundary conditions, or the integrals.
    """
    actions = {x.name: x.bind(bvp.unknowns, bvp.parameter_names) for x in symmetries}
    gauges = tuple(actions[x.name] for x in symmetries if x.gauge)
    for action in actions.values():
        _refuse_logarithms(bvp, action)
    if symmetries:
        with np.errstate(all="ignore"):
            check = Samples(bvp, gauges)
            for action in actions.values():
                check.field(action)
            for action in actions.values():
                if action not in gauges:
                    check.boundary(action)
                    check.integrals(action)
    return {name: action for name, action in actions.items() if action not in gauges}, gauges


def _refuse_logarithms(bvp: BVP, action: Action) -> None:
    """A map that is affine in a parameter is not so in its logarithm."""
    unit = np.eye(len(action.matrix))
    for name in bvp.log:
        i = bvp.size + bvp.parameter_index(name)
        if (action.matrix[i] != unit[i]).any() or (action.matrix[:, i] != unit[:, i]).any():
            raise ValueError(f"symmetries: '{action.name}': expected a map without '{name}', which is followed in its "
                             "logarithm")  # fmt: skip


class Samples:
    """Random points of a problem, and the tests of a symmetry at them."""

    def __init__(self, bvp: BVP, gauges: tuple[Action, ...]):
        self.bvp, self.gauges = bvp, gauges
        self._rng = np.random.default_rng(17)
        self._evaluators: dict[tuple[int, int], Evaluator] = {}
        default = bvp.coordinates(bvp.parameter_vector())
        spread = np.where(default == 0.0, 1.0, np.abs(default))
        each = max(SAMPLES, bvp.n_integral + 3)
        inside = each * len(bvp.layout.weights)
        count = max(inside, bvp.n_boundary + 3)
        self.p = default + spread * self._rng.uniform(-0.5, 0.5, (count, len(default)))
        self.left, self.right = self._rng.uniform(-1.2, 1.2, (2, count, bvp.size))
        (self.u,), self.at = self.constrained([self.left[:inside]], self.p[:inside], False)
        self.s = bvp.layout.samples(self._rng, each)[: len(self.u), None]
        self.f = self.value(bvp.traced.field, self.s, self.u, self.at)
        self.b = self.value(bvp.traced.ends, np.hstack([self.left, self.right]), self.p)[:, : bvp.n_boundary]

    def refuse(self, name: str, what: str) -> NoReturn:
        raise NotRespected(f"symmetries: '{name}' does not respect {what}")

    def field(self, action: Action) -> None:
        """f(r, S u + ..., T p + ...) = S f(s, u, p), with the sign changed when s is reversed."""
        n, traced = self.bvp.size, self.bvp.traced
        image = self.value(traced.field, *self._image(action))
        expected = (-1.0 if action.reverse else 1.0) * self.f @ action.matrix[:n, :n].T
        wrong = differences(action.name, "the right-hand side", expected, image)
        if wrong.any():
            names = ", ".join(name for name, bad in zip(self.bvp.unknowns, wrong, strict=True) if bad)
            self.refuse(action.name, f"the equation for {names}")

    def boundary(self, action: Action) -> None:
        """b(image) is a constant combination of b; or it vanishes, up to a gauge, wherever b does."""
        ends, p, q = np.hstack([self.left, self.right]), self.p, self.bvp.n_boundary
        image = self.value(self.bvp.traced.ends, *self._image_of_ends(action, ends, p))[:, :q]
        if is_combination(action.name, "the boundary conditions", self.b, image):
            return
        (left, right), p = self.constrained([self.left[:SAMPLES], self.right[:SAMPLES]], p[:SAMPLES], True)
        ends, p = self._image_of_ends(action, np.hstack([left, right]), p)
        candidates = [(ends, p)] + [self._image_of_ends(g, ends, p) for g in self.gauges]
        residuals = [np.abs(self.value(self.bvp.traced.ends, *c)[:, :q]) for c in candidates]
        worst = min(residuals, key=lambda r: r.max(axis=1).sum()) if len(p) else image
        best = np.min([r.max(axis=1) for r in residuals], axis=0) if len(p) else np.ones(1)
        if len(p) < 3 or not (best < 1e3 * TOLERANCE).all():
            rows = ", ".join(str(i) for i in np.flatnonzero(~(worst.max(axis=0) < 1e3 * TOLERANCE)))
            self.refuse(action.name, f"the boundary conditions (residuals {rows})")

    def integrals(self, action: Action) -> None:
        """The integrands of the image are constant combinations of the integrands."""
        if not self.bvp.n_integral:
            return
        k, densities = self.bvp.n_integral, self.bvp.traced.densities
        g = self.value(densities, self.s, self.u, self.at)[:, :k]
        image = self.value(densities, *self._image(action))[:, :k]
        if not is_combination(action.name, "the integral conditions", g, image):
            self.refuse(action.name, "the integral conditions")

    def _outputs(self, function: Any, *arguments: np.ndarray) -> list[np.ndarray]:
        """A traced function at points (K, .): outputs (K, .), matrices column-major per point; overwritten later."""
        key = id(function), len(arguments[0])
        if not key[1]:
            return [np.zeros((0, function.numel_out(i))) for i in range(function.n_out())]
        if key not in self._evaluators:
            self._evaluators[key] = Evaluator(function, key[1])
        return self._evaluators[key](*arguments)

    def value(self, function: Any, *arguments: np.ndarray) -> np.ndarray:
        return self._outputs(function, *arguments)[0].copy()

    def _image(self, action: Action) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s = 1 - self.s if action.reverse else self.s
        return s, action.unknowns(self.u, self.at), action.parameters(self.at)

    def _image_of_ends(self, action: Action, ends: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        left, right = (action.unknowns(x, p) for x in np.split(ends, 2, axis=1))
        return np.hstack([right, left] if action.reverse else [left, right]), action.parameters(p)

    def constrained(
        self, states: list[np.ndarray], p: np.ndarray, boundary: bool
    ) -> tuple[list[np.ndarray], np.ndarray]:
        """Nearby points where the problem's identities hold, and the boundary conditions if wanted (then p moves).

        Damped Newton with the smallest corrections, for an identity may repeat at an end what a boundary condition
        says; points that do not converge are left out.
        """
        if not boundary and self.bvp.traced.identities is None:
            return states, p
        n, count = self.bvp.size, len(states)
        weight = 0.1 if boundary else 0.0  # parameters move when they must
        z = np.hstack([*states, p])
        for _ in range(12):
            value, jac = self._constraints(np.split(z[:, : count * n], count, axis=1), z[:, count * n :], boundary)
            jac[:, :, count * n :] *= weight
            gram = jac @ jac.transpose(0, 2, 1)
            good = np.isfinite(gram).all(axis=(1, 2)) & np.isfinite(value).all(axis=1)
            z, value, jac, gram = z[good], value[good], jac[good], gram[good]
            error = np.abs(value).max(axis=1, initial=0.0)
            damping = (1e-13 + 1e-2 * np.minimum(error, 1.0) ** 2) * np.maximum(np.trace(gram, axis1=1, axis2=2), 1e-9)
            gram += damping[:, None, None] * np.eye(gram.shape[1])
            move = (jac.transpose(0, 2, 1) @ np.linalg.solve(gram, value[:, :, None]))[:, :, 0]
            move[:, count * n :] *= weight
            z = z - move / np.maximum(1.0, np.linalg.norm(move, axis=1, keepdims=True) / np.sqrt(n))
            if not (error > 1e-5).any():  # squared by this step
                break
        z = z[error < 1e-5]
        return np.split(z[:, : count * n], count, axis=1), z[:, count * n :]

    def _constraints(self, states: list[np.ndarray], p: np.ndarray, boundary: bool) -> tuple[np.ndarray, np.ndarray]:
        """Values (K, r) and derivatives (K, r, count n + np) of identities at every state, and of b."""
        n, k, q = self.bvp.size, len(self.bvp.parameters), self.bvp.n_boundary
        identities = self.bvp.traced.identities
        values, rows = [np.zeros((len(p), 0))], [np.zeros((len(p), 0, len(states) * n + k))]
        if boundary:
            b, b_u, b_p = self._outputs(self.bvp.traced.ends, np.hstack(states), p)
            both = np.concatenate([b_u.reshape(len(p), 2 * n, -1), b_p.reshape(len(p), k, -1)], axis=1)
            values.append(b[:, :q].copy())
            rows.append(both.transpose(0, 2, 1)[:, :q])
        for i, u in enumerate(states if identities is not None else ()):
            value, d_u, d_p = self._outputs(identities, u, p)
            row = np.zeros((len(p), value.shape[1], len(states) * n + k))
            row[:, :, i * n : (i + 1) * n] = d_u.reshape(len(p), n, -1).transpose(0, 2, 1)
            row[:, :, len(states) * n :] = d_p.reshape(len(p), k, -1).transpose(0, 2, 1)
            values.append(value.copy())
            rows.append(row)
        return np.hstack(values), np.concatenate(rows, axis=1)


def differences(name: str, where: str, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Columns in which two arrays (K, .) differ by more than round-off; rows that are not finite do not count."""
    good = np.isfinite(one).all(axis=1) & np.isfinite(two).all(axis=1)
    if good.sum() < 3:
        raise ValueError(f"symmetries: '{name}' cannot be checked: {where} gave NaN or infinity at most points")
    one, two = one[good], two[good]
    size = 1.0 + np.abs(np.hstack([one, two])).max(axis=1, keepdims=True, initial=0.0)
    return (np.abs(one - two) > TOLERANCE * size).any(axis=0)


def is_combination(name: str, where: str, values: np.ndarray, images: np.ndarray) -> bool:
    """Whether images = values R for one matrix R at all points."""
    good = np.isfinite(values).all(axis=1) & np.isfinite(images).all(axis=1)
    if good.sum() <= values.shape[1]:
        return False
    factors = np.linalg.lstsq(values[good], images[good], rcond=1e-10)[0]
    return not differences(name, where, values[good] @ factors, images[good]).any()


def _affine(expression: str, names: Sequence[str]) -> np.ndarray:
    """Coefficients of the names and the constant, (len(names) + 1,), of an affine expression."""
    unit = np.eye(len(names) + 1)

    def walk(node: ast.AST) -> np.ndarray:
        match node:
            case ast.Constant(value=int() | float() as value):
                return float(value) * unit[-1]
            case ast.Name(id=name) if name in names:
                return unit[list(names).index(name)]
            case ast.Name(id="pi"):
                return math.pi * unit[-1]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return -walk(operand)
            case ast.BinOp(op=ast.Add(), left=left, right=right):
                return walk(left) + walk(right)
            case ast.BinOp(op=ast.Sub(), left=left, right=right):
                return walk(left) - walk(right)
            case ast.BinOp(op=ast.Mult(), left=left, right=right):
                one, two = sorted((walk(left), walk(right)), key=lambda form: bool(form[:-1].any()))
                if not one[:-1].any():
                    return one[-1] * two
            case ast.BinOp(op=ast.Div(), left=left, right=right) if not walk(right)[:-1].any():
                return walk(left) / walk(right)[-1]
        raise ValueError(f"expected an affine expression of {', '.join(names)}, got '{expression}'")

    try:
        return walk(ast.parse(expression, mode="eval").body)
    except SyntaxError:
        raise ValueError(f"expected an affine expression of {', '.join(names)}, got '{expression}'") from None
