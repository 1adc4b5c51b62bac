r"""Normal forms: the reduced equation on the kernel, whose coefficients say what a bifurcation looks like."""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.directional import derivatives_along
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.results.branch import NormalForm
from rodatlas.continuation.singular.augmented import Augmented
from rodatlas.continuation.singular.bordered import UPRIGHT, Border, Bordered, overlap


def branch_point_form(
    colloc: Collocation, found: Augmented, directions: tuple[Columns, ...]
) -> tuple[NormalForm, Columns | None]:
    r"""Normal form of a converged branch point, and the second derivative of the other curve through it.

    With unit tangents d of the curve in question and e of the one that it crosses, the curve is
    :math:`X_0 + a d + \tfrac12 a^2 w`, where :math:`F'w = -F''[d,d]`; its share of e follows from the third order,

    .. math:: w = w_0 - \frac{\psi\cdot(F'''[d,d,d] + 3F''[d,w_0])}{3\,\psi\cdot F''[d,e]}\,e, \qquad
              \lambda'' = w_\lambda.
    """
    if len(directions) < 2 or found.column is None:
        return NormalForm("isolated"), None
    along, other = directions
    unit = float(colloc.scale.parameters[colloc.free[0]])
    bend = _second_derivative(colloc, found, other, along)
    if bend is None:
        return NormalForm("degenerate"), None
    if abs(along.scalars[0]) < UPRIGHT < abs(other.scalars[0]):  # met along the side branch
        side = _second_derivative(colloc, found, along, other)
        return NormalForm("pitchfork", 0.0, unit * float(side.scalars[0]) if side else float("nan")), bend
    slope = float(other.scalars[0])
    kind, slope = ("pitchfork", 0.0) if abs(slope) < UPRIGHT else ("transcritical", unit * slope)
    return NormalForm(kind, slope, unit * float(bend.scalars[0])), bend


def _second_derivative(colloc: Collocation, found: Augmented, d: Columns, e: Columns) -> Columns | None:
    """Second derivative with respect to arclength, at the branch point, of the curve with tangent d."""
    assert found.column is not None
    x, border = found.state, Border(found.vectors, found.column)
    b = Bordered(colloc, colloc.linearize(x), border, list(range(len(colloc.free))))
    if b.fac.sign == 0.0:
        return None
    psi = b.left()
    second, third = derivatives_along(colloc, x, d)
    gradient = colloc.second(x, d, psi)
    mixed = gradient.dot(e)
    if mixed == 0.0:
        return None
    w, _ = b.solve(second, [0.0, 0.0], {})
    w = add(w, (-(overlap(psi, third) + 3 * gradient.dot(w)) / (3 * mixed), e))
    return add(w, (-colloc.inner(w, d), d))  # at unit speed it is normal to the tangent


def cusp_form(colloc: Collocation, x: Columns, border: Border) -> dict[str, float]:
    r"""Coefficients of the reduced equation at a cusp, with unit vectors :math:`\varphi` and :math:`\psi`,

    .. math:: f_\lambda\,\delta\lambda + f_\mu\,\delta\mu
              + (g_\lambda\,\delta\lambda + g_\mu\,\delta\mu)\,a + \tfrac16 c\,a^3 = 0,

    with :math:`c = \psi\cdot(F'''\varphi^3 + 3F''\varphi w), M w = -F''\varphi^2`. Keys: 'cubic' (c),
    'constant lambda', 'constant mu' (f), 'linear lambda', 'linear mu' (g); derivatives g include what the parameter
    makes of the solution.
    """
    lin = colloc.linearize(x)
    b = Bordered(colloc, lin, border, list(range(2, len(colloc.free))))
    psi = b.left()
    phi, _ = b.solve(None, [1.0], {})
    size, length = colloc.norm(phi), np.sqrt(overlap(psi, psi))
    second, third = derivatives_along(colloc, x, phi)
    gradient = colloc.second(x, phi, psi)
    w, _ = b.solve(second, [0.0], {})
    found = {"cubic": (overlap(psi, third) + 3 * gradient.dot(w)) / (size**3 * length)}
    for i, name in enumerate(("lambda", "mu")):
        along, share = b.solve(lin.column(i), [0.0], {i: 1.0})
        found[f"constant {name}"] = -share / length
        found[f"linear {name}"] = gradient.dot(along) / (size * length)
    return found


def fold_quadratic(
    colloc: Collocation, x: Columns, border: Border, along: int, across: int
) -> tuple[np.ndarray, float]:
    r"""Reduced equation of a fold in two parameters where its locus is extreme in one of them.

    With p the scalar `along` and q the scalar `across`, the kernel of :math:`(F_x, F_p)` is spanned by
    :math:`v_1 = (\varphi, 0)` and :math:`v_2` with :math:`F_x v_2 = -F_p`; solutions are

    .. math:: (\psi\cdot F_q)\,\delta q + \tfrac12 \sum_{ij} a_i a_j\,\psi\cdot F''[v_i, v_j] = 0.

    Returns the form (2, 2) and :math:`\psi\cdot F_q`.
    """
    lin = colloc.linearize(x)
    b = Bordered(colloc, lin, border, list(range(2, len(colloc.free))))
    psi = b.left()
    phi, _ = b.solve(None, [1.0], {})
    beside, _ = b.solve(lin.column(along), [0.0], {along: 1.0})
    _, share = b.solve(lin.column(across), [0.0], {across: 1.0})
    vectors = (phi, beside)
    form = np.array([[colloc.second(x, v, psi).dot(w) for w in vectors] for v in vectors])
    return (form + form.T) / 2, -share
