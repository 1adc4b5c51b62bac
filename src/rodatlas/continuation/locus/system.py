r"""Folds and branch points in two or three parameters: the linear problem behind one Newton step along their locus.

Free parameters are (lambda, mu, inner ones): lambda is the parameter of the branches on which the points lie, mu the
second one. Every correction is a combination

.. math:: dX = y_0 + \sum_{j=1}^{3} a_j d_j

of solutions of one bordered system, with three coefficients that two conditions and the arclength fix:

* Fold: with :math:`M = (F_x, F_{inner})` at fixed lambda and mu, :math:`M\varphi + b g = 0, c \cdot \varphi = 1`; the
  directions are :math:`(-M^{-1}F_\lambda, 1, 0), (-M^{-1}F_\mu, 0, 1), (\varphi, 0, 0)` (inverses bordered with b, c),
  the conditions: no share of b is left over, and g = 0. The system stays regular where the locus passes a branch
  point, that is where folds are born or lost.
* Branch point that persists (on a branch that symmetry or a trivial solution protects): with
  :math:`F' = (F_x, F_\lambda, F_{inner})` bordered as in `singular/augmented.py`; the directions are
  :math:`(-F'^{-1}F_\mu, 1)`, the kernel vector v_1 along the protected branch, and the other one, phi, which leaves
  lambda alone; the conditions g_1 = g_2 = 0. Where two branch points meet, g_1 no longer determines the motion along
  phi, which is zero by symmetry: a small weight on it keeps the system regular there. The artificial unknown stays
  zero as long as the branch point persists.

* Branch point that nothing protects: it has codimension two, and goes along a third parameter nu. With F' as before the
  directions are :math:`(-F'^{-1}F_\mu, 1, 0), (-F'^{-1}F_\nu, 0, 1)` and two kernel vectors, with one coefficient
  more; that no share of b is left over takes the place of the artificial unknown.

One factorization serves all solves of a step (Govaerts 2000, chapters 4 and 8). Loci of a prescribed value of an
observable are in `value.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Linearization
from rodatlas.continuation.discrete.directional import derivatives_along
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.bordered import (
    UPRIGHT,
    Border,
    Bordered,
    Tests,
    left_column,
    norm_of,
    overlap,
    unit_vector,
)

UNPROTECTED = "unprotected branch point"
KINDS = ("fold", "branch point", UNPROTECTED)
HOLD = 1e-4  # weight of 'no motion along the last direction' in units of the largest other; it matters only where
# nothing else holds it, and would slow Newton's method down if all others were smaller (large forces: by 1e-3 and more)

OPEN = 3.0  # times what the conditions say of the last direction: with more weight it counts as left open


@dataclass(frozen=True)
class Local:
    """The linear problem at one state.

    base : y_0, base_b : its share of the column; directions : d_1 .. d_3 and shares (3,); conditions (2, 3) and
    values (2,) with conditions @ a = values (at an unprotected branch point one more of each); border : better borders
    for the next step; measure : evaluates the test functions, with the weakest direction of a point near by or None;
    hold : weight of a_3 = 0.
    """

    base: Columns
    base_b: float
    directions: tuple[Columns, ...]
    shares: np.ndarray
    conditions: np.ndarray
    values: np.ndarray
    border: Border
    measure: Callable[[Columns | None], Tests]
    hold: float = 0.0

    def step(self, colloc: Collocation, normal: Columns, value: float) -> tuple[Columns, float] | None:
        """Correction with <normal, dX> = value, and the change of the artificial unknown."""
        row = np.array([colloc.inner(normal, d) for d in self.directions])
        matrix = np.vstack([self.conditions, row])
        right = np.append(self.values, value - colloc.inner(normal, self.base))
        found = self._combine(matrix, right, self.base, self.base_b)
        return None if found is None else (colloc.kept_symmetric(found[0]), found[1])

    def tangent(self, colloc: Collocation, along: Columns) -> Columns | None:
        """Unit tangent of the locus with <tangent, along> > 0."""
        row = np.array([colloc.inner(along, d) for d in self.directions])
        right = np.append(np.zeros(len(self.values)), 1.0)
        found = self._combine(np.vstack([self.conditions, row]), right, scaled(self.base, 0.0), 0.0)
        return None if found is None else unit_vector(colloc, found[0])

    def null_vector(self, colloc: Collocation) -> Columns:
        """Unit tangent of the locus, of either sense."""
        scale = np.array([colloc.norm(d) for d in self.directions])
        _, _, vt = np.linalg.svd(self.conditions / scale)
        t = add(scaled(self.base, 0.0), *zip((vt[-1] / scale).tolist(), self.directions, strict=True))
        return unit_vector(colloc, t)

    def _combine(
        self, matrix: np.ndarray, right: np.ndarray, base: Columns, base_b: float
    ) -> tuple[Columns, float] | None:
        if not np.isfinite(matrix).all():
            return None
        a = self._coefficients(matrix, right)
        if a is None:
            return None
        return add(base, *zip(a.tolist(), self.directions, strict=True)), base_b + float(self.shares @ a)

    def _coefficients(self, matrix: np.ndarray, right: np.ndarray) -> np.ndarray | None:
        """Solve the conditions (3, 3); where `hold` is set, a last direction that they leave open is left out.

        The weight is used only where it matters: elsewhere Newton's method would lose its quadratic convergence to it.
        """
        try:
            own = abs(np.asarray(np.linalg.qr(matrix, mode="r"))[-1, -1])  # what they say of the last direction
            if self.hold == 0.0 or self.hold < OPEN * own:
                return np.linalg.solve(matrix, right)
            q, r = np.linalg.qr(np.vstack([matrix, [0.0, 0.0, self.hold]]))
            return np.linalg.solve(r, q.T @ np.append(right, 0.0))
        except np.linalg.LinAlgError:
            return None


def local_problem(kind: str, colloc: Collocation, x: Columns, border: Border, beta: float) -> Local | None:
    """The linear problem of a locus at a state; None when it is singular."""
    lin = colloc.linearize(x)
    if not lin.is_finite:
        return None
    if kind == UNPROTECTED:
        return _unprotected(colloc, x, lin, border)
    return _fold(colloc, x, lin, border) if kind == "fold" else _branch_point(colloc, x, lin, border, beta)


def scalars_of(kind: str, count: int) -> list[int]:
    """Which of the free parameters, by number, the matrix of a kind of points has columns of."""
    if kind == "fold":
        return list(range(2, count))
    return [0, *range(3 if kind == UNPROTECTED else 2, count)]


def _fold(colloc: Collocation, x: Columns, lin: Linearization, border: Border) -> Local | None:
    b = Bordered(colloc, lin, border, scalars_of("fold", len(colloc.free)))
    if b.is_singular:
        return None
    phi, g = b.solve(None, [1.0], {})
    phi = colloc.kept_symmetric(phi)  # where another vector joins the kernel, it is known up to that one only
    along_lambda, share_lambda = b.solve(lin.column(0), [0.0], {0: 1.0})
    along_mu, share_mu = b.solve(lin.column(1), [0.0], {1: 1.0})
    base, share = b.solve(lin.residual, [0.0], {})
    psi = b.left()
    gradient = scaled(colloc.second(x, phi, psi), -1.0)
    directions = (along_lambda, along_mu, phi)
    conditions = np.array([[share_lambda, share_mu, g], [gradient.dot(d) for d in directions]])
    values = np.array([-share, -(g + gradient.dot(base))])
    size = colloc.norm(phi)

    def measure(near: Columns | None) -> Tests:
        quadratic = -float(conditions[1, 2]) / (size**2 * norm_of(psi))
        return b.tests({"cusp": quadratic}, near, (share_lambda, share_mu))

    new = Border((scaled(phi, 1.0 / size),), left_column(colloc, psi))
    return Local(base, share, directions, np.array([share_lambda, share_mu, g]), conditions, values, new, measure)


def _branch_point(colloc: Collocation, x: Columns, lin: Linearization, border: Border, beta: float) -> Local | None:
    b = Bordered(colloc, lin, border, scalars_of("branch point", len(colloc.free)))
    if b.is_singular:
        return None
    (p1, h1), (p2, h2) = b.solve(None, [1.0, 0.0], {}), b.solve(None, [0.0, 1.0], {})
    cosine, sine = _turn(float(p1.scalars[0]), float(p2.scalars[0]))
    v1, v2 = add(scaled(p1, cosine), (sine, p2)), add(scaled(p2, cosine), (-sine, p1))
    g1, g2 = cosine * h1 + sine * h2, cosine * h2 - sine * h1
    along_mu, share_mu = b.solve(lin.column(1), [0.0, 0.0], {1: 1.0})
    r, c = lin.residual, border.column
    shifted = Blocks(r.stage + beta * c.stage, r.chain, r.ends + beta * c.ends, r.dense + beta * c.dense)
    base, share = b.solve(shifted, [0.0, 0.0], {})
    psi = b.left()
    gradients = [scaled(colloc.second(x, v, psi), -1.0) for v in (v1, v2)]
    directions = (along_mu, v1, v2)
    conditions = np.array([[w.dot(d) for d in directions] for w in gradients])
    values = -np.array([g1, g2]) - [w.dot(base) for w in gradients]
    largest = float(np.abs(conditions / [colloc.norm(d) for d in directions]).max())

    def measure(near: Columns | None) -> Tests:
        size = colloc.norm(v2)
        quadratic = -gradients[1].dot(v2) / (size**2 * norm_of(psi))
        trunk = float(v1.scalars[0]) / colloc.norm(v1)
        cubic = _cubic(colloc, x, b, v1, v2, psi, gradients[1])
        values = {"trunk": trunk, "quadratic": quadratic, "criticality": cubic}
        return b.tests(values, near)

    return Local(
        base, share, directions, np.array([share_mu, g1, g2]), conditions, values,
        Border(_orthonormal(colloc, v1, v2), left_column(colloc, psi)), measure,
        HOLD * largest,
    )  # fmt: skip


def _unprotected(colloc: Collocation, x: Columns, lin: Linearization, border: Border) -> Local | None:
    b = Bordered(colloc, lin, border, scalars_of(UNPROTECTED, len(colloc.free)))
    if b.is_singular:
        return None
    (v1, g1), (v2, g2) = b.solve(None, [1.0, 0.0], {}), b.solve(None, [0.0, 1.0], {})
    (along_mu, share_mu), (along_nu, share_nu) = (b.solve(lin.column(i), [0.0, 0.0], {i: 1.0}) for i in (1, 2))
    base, share = b.solve(lin.residual, [0.0, 0.0], {})
    psi = b.left()
    gradients = [scaled(colloc.second(x, v, psi), -1.0) for v in (v1, v2)]
    directions = (along_mu, along_nu, v1, v2)
    shares = np.array([share_mu, share_nu, g1, g2])
    conditions = np.vstack([shares, [[w.dot(d) for d in directions] for w in gradients]])
    values = np.array([-share, *(-g - w.dot(base) for g, w in zip((g1, g2), gradients, strict=True))])

    def measure(near: Columns | None) -> Tests:
        cosine, sine = _turn(float(v1.scalars[0]), float(v2.scalars[0]))
        upright = add(scaled(v2, cosine), (-sine, v1))
        gradient = add(scaled(gradients[1], cosine), (-sine, gradients[0]))
        quadratic = -gradient.dot(upright) / (colloc.norm(upright) ** 2 * norm_of(psi))
        return b.tests({"quadratic": quadratic}, near)

    new = Border(_orthonormal(colloc, v1, v2), left_column(colloc, psi))
    return Local(base, share, directions, shares, conditions, values, new, measure)


def _turn(l1: float, l2: float) -> tuple[float, float]:
    """Cosine and sine of the rotation that leaves the second of two kernel vectors without a lambda component.

    It is the smaller one of the two that do, so that vectors and their signs are continuous along a locus; where both
    components vanish (the protected branch has a fold) it is none.
    """
    if abs(l2) < UPRIGHT:
        return 1.0, 0.0
    length = float(np.copysign(np.hypot(l1, l2), l1))
    return l1 / length, l2 / length


def _cubic(
    colloc: Collocation, x: Columns, b: Bordered, v1: Columns, phi: Columns, psi: Blocks, gradient: Columns
) -> float:
    r"""Cubic coefficient of a pitchfork times the lambda component of the trunk's tangent :math:`v_1`,

    .. math:: v_{1\lambda}\,\psi\cdot(F'''\varphi^3 + 3F''\varphi w), \quad F'w = -F''\varphi^2, \quad w_\lambda = 0,

    for unit vectors: it is zero where the pitchfork changes between super- and subcritical, and finite where the trunk
    has a fold. `gradient` is that of :math:`-\psi\cdot F'\varphi`.
    """
    second, third = derivatives_along(colloc, x, phi)
    w, _ = b.solve(second, [0.0, 0.0], {})
    upright = float(v1.scalars[0]) * (overlap(psi, third) - 3 * gradient.dot(w))
    product = upright + 3 * float(w.scalars[0]) * gradient.dot(v1)
    return product / (colloc.norm(v1) * colloc.norm(phi) ** 3 * norm_of(psi))


def _orthonormal(colloc: Collocation, v1: Columns, v2: Columns) -> tuple[Columns, Columns]:
    one = scaled(v1, 1.0 / colloc.norm(v1))
    two = add(v2, (-colloc.inner(v2, one), one))
    return one, scaled(two, 1.0 / colloc.norm(two))
