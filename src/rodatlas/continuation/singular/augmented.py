r"""Folds and branch points as regular solutions of minimally augmented systems.

With the derivative F' of n conditions with respect to n + 1 variables X (states and free parameters) and a row c:

* Fold: in :math:`F' v = 0, c \cdot v = 1` the component :math:`v_\lambda` of the continuation parameter vanishes.
* Branch point: with two rows C and a column b, the solution of

  .. math:: \begin{pmatrix} F' & b \\ C & 0 \end{pmatrix} \begin{pmatrix} V \\ g \end{pmatrix} =
            \begin{pmatrix} 0 \\ I_2 \end{pmatrix}

  has :math:`g = (g_1, g_2) = 0` exactly where F' loses rank. An artificial unknown :math:`\beta` that enters as
  :math:`F + \beta b = 0` makes the system square; it is zero at a branch point that persists.

The derivative of a bordered scalar needs one transposed solve and one second directional derivative, so each Newton
step costs one factorisation (Griewank & Reddien 1984; Beyn 1990; Govaerts 2000, chapter 4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.random_fields import displacement
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.bordered import BorderedSystem, left_column, loaded, unit


@dataclass(frozen=True)
class Augmented:
    """Outcome of Newton on an augmented system.

    Attributes
    ----------
    vectors : span the kernel (one at a fold, two at a branch point).
    form : the quadratic form w.F''[v_i, v_j] of the reduced equation on the kernel.
    residual : size of the last correction; unfolding : beta.
    correction : the last correction; column : b, at a branch point.
    """

    converged: bool
    state: Columns
    vectors: tuple[Columns, ...]
    form: np.ndarray
    residual: float
    iterations: int
    unfolding: float = 0.0
    correction: Columns | None = None
    column: Blocks | None = None


def solve_fold(
    colloc: Collocation, x: Columns, tangent: Columns, tolerance: float = 1e-9, max_iterations: int = 8
) -> Augmented:
    """Newton for F = 0, v_lambda = 0 from a state near a fold of the first free parameter."""
    row = colloc.row(tangent)
    v, form, residual, dx = tangent, np.nan, np.inf, None
    for i in range(max_iterations):
        lin = colloc.linearize(x)
        b = BorderedSystem(colloc, lin, [row])
        if b.is_singular:
            return Augmented(False, x, (v,), np.array([[form]]), residual, i)
        v, _ = b.solved(None, [1.0])
        gradient = scaled(colloc.second(x, v, b.left_vector(0)), -1.0)
        y, _ = b.solved(lin.residual, [0.0])
        slope = gradient.dot(v)
        if slope == 0.0 or not np.isfinite(slope):
            return Augmented(False, x, (v,), np.array([[form]]), residual, i)
        alpha = -(v.scalars[0] + gradient.dot(y)) / slope
        dx = add(y, (alpha, v))
        x = add(x, (1.0, dx))
        size = colloc.norm(dx)
        form = slope / colloc.inner(v, v)
        converged, residual = _settled(residual, size, tolerance)
        if converged or size > 10.0:
            return Augmented(converged, x, (v,), np.array([[form]]), size, i + 1, correction=dx)
    return Augmented(False, x, (v,), np.array([[form]]), residual, max_iterations, correction=dx)


def solve_branch_point(
    colloc: Collocation, x: Columns, tangent: Columns, tolerance: float = 1e-9, max_iterations: int = 10,
    border: tuple[list[Row], Blocks] | None = None,
) -> Augmented:  # fmt: skip
    """Newton for F + beta b = 0, g = 0 from a state near a simple branch point on the branch with this tangent.

    The border (rows C and column b) is found by inverse iteration unless it is given.
    """
    border = border or _borders(colloc, x, tangent)
    if border is None:
        return Augmented(False, x, (tangent,), np.full((2, 2), np.nan), np.inf, 0)
    rows, column = border
    beta, residual, dx = 0.0, np.inf, None
    vectors: tuple[Columns, ...] = (tangent,)
    form = np.full((2, 2), np.nan)
    for i in range(max_iterations):
        lin = colloc.linearize(x)
        b = BorderedSystem(colloc, lin, rows, [column])
        if b.is_singular:
            break
        kernel, shares = b.kernel()
        vectors, g, w = tuple(kernel), shares[0], b.left_vector(-1)
        gradients = [scaled(colloc.second(x, u, w), -1.0) for u in vectors]
        bare, share = b.solved(loaded(lin.residual, [beta], [column]), [0.0, 0.0])
        form = np.array([[gi.dot(u) for u in vectors] for gi in gradients])
        try:
            alpha = np.linalg.solve(form, -(g + np.array([gi.dot(bare) for gi in gradients])))
        except np.linalg.LinAlgError:
            break
        dx = add(bare, *zip(alpha.tolist(), vectors, strict=True))
        x = add(x, (1.0, dx))
        beta += float(share[0] + alpha @ g)
        size = colloc.norm(dx)
        converged, residual = _settled(residual, size, tolerance)
        if converged or size > 10.0:
            return Augmented(converged, x, vectors, form, size, i + 1, beta, dx, column)
    return Augmented(False, x, vectors, form, residual, max_iterations, beta, dx, column)


def branch_directions(colloc: Collocation, found: Augmented, tangent: Columns) -> tuple[Columns, ...]:
    r"""Tangents of the two curves through a branch point, the one nearer to `tangent` first.

    They are the roots of the algebraic branching equation :math:`\sum a_i a_j\, w \cdot F''[v_i, v_j] = 0`
    (Keller 1977); the second one is empty when the form is definite (an isolated point).
    """
    v1, v2 = found.vectors
    a, b, c = found.form[0, 0], (found.form[0, 1] + found.form[1, 0]) / 2, found.form[1, 1]
    discriminant = b * b - a * c
    size = np.abs(found.form).max()
    if not discriminant > 1e-14 * size**2:
        return (tangent,)
    root = np.sqrt(discriminant)
    # stable roots of a x^2 + 2 b x y + c y^2 = 0
    q = -(b + np.copysign(root, b))
    pairs = [(q, a), (c, q)]
    found_directions = []
    for one, two in pairs:
        direction = add(scaled(v1, one), (two, v2))
        found_directions.append(scaled(direction, 1.0 / colloc.norm(direction)))
    found_directions.sort(key=lambda d: -abs(colloc.inner(d, tangent)))
    first = found_directions[0]
    return scaled(first, np.copysign(1.0, colloc.inner(first, tangent))), found_directions[1]


def kernel_directions(colloc: Collocation, x: Columns, along: Columns) -> tuple[Columns, tuple[Columns, ...]] | None:
    """State and tangents at a simple branch point close to x, when no tangent is known; None when there is none.

    The tangent nearer to `along` comes first.
    """
    border = displacement(colloc, np.random.default_rng(11), len(x.scalars))
    found = solve_branch_point(colloc, x, scaled(border, 1.0 / colloc.norm(border)))
    if not found.converged:
        return None
    directions = branch_directions(colloc, found, along)
    return (found.state, directions) if len(directions) == 2 else None


def _borders(colloc: Collocation, x: Columns, tangent: Columns) -> tuple[list[Row], Blocks] | None:
    """Rows (tangent, second kernel vector) and column (left kernel vector) from inverse iteration."""
    row = colloc.row(tangent)
    rng = np.random.default_rng(7)
    fac = colloc.factor(colloc.linearize(x), [row])
    if fac.sign == 0.0:  # exactly singular: vectors from close by will do
        near = add(x, (1e-6, displacement(colloc, rng, len(x.scalars))))
        fac = colloc.factor(colloc.linearize(near), [row])
    if fac.sign == 0.0:
        return None
    phi = Columns(rng.normal(size=x.stage.shape), rng.normal(size=x.mesh.shape), rng.normal(size=x.scalars.shape))
    psi = fac.solve_transposed(phi)
    for _ in range(3):
        psi = unit(psi)
        phi = fac.solve(psi)
        phi = scaled(phi, 1.0 / max(colloc.norm(phi), 1e-300))
        weights = colloc.row(phi)
        assert weights.stage is not None
        psi = fac.solve_transposed(Columns(weights.stage, np.zeros_like(phi.mesh), weights.scalars))
    phi = add(phi, (-colloc.inner(phi, tangent), tangent))
    phi = scaled(phi, 1.0 / colloc.norm(phi))
    return [row, colloc.row(phi)], left_column(colloc, psi)


def _settled(previous: float, size: float, tolerance: float) -> tuple[bool, float]:
    """Converged when the correction is tiny, or when it is small and stops decreasing (round-off)."""
    return size < tolerance or (size < 1e3 * tolerance and size > 0.5 * previous), size
