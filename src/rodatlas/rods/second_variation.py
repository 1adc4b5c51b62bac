"""Morse index of a rod equilibrium from the second variation of its discretized energy.

An independent check of `rodatlas.rods.conjugate_points`: slower, and nothing of the derivation is shared.

The rod is cut into n segments of length h, with a unit quaternion q_i at each node. With the vector part of
`conj(q_i) q_{i+1}` as a measure of strain, `kappa_i = (2/h) vec(conj(q_i) q_{i+1})`, minimize::

    E = sum_i (h/2) (a kappa_1^2 + b kappa_2^2 + tau^2)_i - int f . X ds

with both end quaternions fixed, `int d3 ds = X(1) - X(0)` by the trapezoidal rule, and kappa_2 = 0 in every segment
if b is infinite. Strains and directors are quadratic in the quaternions, so all derivatives are elementary. The
sampled state is first moved to the equilibrium of the discrete problem by Newton's method. The index is the number
of negative eigenvalues of the Hessian of the Lagrangian on the null space of the linearized constraints, which is
the negative inertia of the Karush-Kuhn-Tucker matrix less the rank of the constraints. Eigenvalues are divided by h,
so that they converge to those of the second variation relative to `int |theta|^2 ds`, theta being the rotation of
the sections. Their error is even in h; they are extrapolated from n, n/2 and n/4 segments.

Sources: J. Nocedal and S. Wright, Numerical Optimization (2006), theorem 16.3 (inertia); P.-A. Absil, R. Mahony
and R. Sepulchre (2008), section 5.5 (Hessian on a product of spheres).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rodatlas.continuation.checks import as_array, check_type
from rodatlas.rods.law import LinearLaw, Rested

Array = npt.NDArray[np.float64]

# vec(conj(q) r)_k = q . PRODUCT[k] r for quaternions q, r.
PRODUCT = np.array(
    [
        [[0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, -1], [0, 0, 1, 0]],
        [[0, 0, 1, 0], [0, 0, 0, 1], [-1, 0, 0, 0], [0, -1, 0, 0]],
        [[0, 0, 0, 1], [0, 0, -1, 0], [0, 1, 0, 0], [-1, 0, 0, 0]],
    ],
    dtype=np.float64,
)
# d3_k = q . TANGENT[k] q.
TANGENT = np.array(
    [
        [[0, 0, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0]],
        [[0, -1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]],
        [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]],
    ],
    dtype=np.float64,
)
# Newton stops at the first residual and is believed up to the second: forces of order 1000 round off in between.
NEWTON_TOLERANCE = 1e-9
CONVERGED = 1e-6
MAX_NEWTON = 15
# A discrete equilibrium further than this from the sampled state (chord of the quaternions) is another one.
MAX_DEPARTURE = 0.1
COARSE_DEPARTURE = 0.5
# Pivots of the constraints below this fraction of the largest count as zero.
RANK_TOLERANCE = 1e-9


@dataclass(frozen=True)
class SecondVariationResult:
    """Morse index of a discretized rod.

    Attributes
    ----------
    index : int
        Number of negative eigenvalues of the second variation; -1 if no discrete equilibrium was found.
    eigenvalues : ndarray, shape (m,)
        Its lowest eigenvalues, extrapolated to n = infinity [GJ/L^2], in increasing order.
    smallest : float
        The one nearest to zero.
    error : float
        The last correction of the extrapolation to it.
    departure : float
        Largest distance between sampled and discrete quaternions.
    rank_deficiency : int
        Number of end conditions that the others imply to first order (a straight rod), otherwise 0.
    trusted : bool
        Whether nothing speaks against the index.
    reason : str
        What does; empty if `trusted`.
    """

    index: int
    eigenvalues: Array
    smallest: float
    error: float
    departure: float
    rank_deficiency: int
    trusted: bool
    reason: str

    def __repr__(self) -> str:
        note = "" if self.trusted else f", not trusted: {self.reason}"
        return f"SecondVariationResult(index={self.index}, smallest={self.smallest:.3g}{note})"


class _Spectrum(NamedTuple):
    """The eigenvalues on one mesh, and how Newton's method ended there.

    `residual` is the last one, `deficiency` the number of end conditions that the others imply, and `departure` the
    largest distance between sampled and discrete quaternions.
    """

    eigenvalues: Array
    residual: float
    deficiency: int
    departure: float


@dataclass(frozen=True)
class _Rod:
    """What does not change in Newton's method: stiffness (3,), chord (3,), load (3,), strain without load (3,), and
    whether kappa_2 cannot change."""

    stiffness: Array
    chord: Array
    load: Array
    rest: Array
    unbendable: bool


def _strains(q: Array) -> tuple[Array, Array, Array]:
    """Strains (n, 3) and their derivatives (n, 3, 4) with respect to the left and the right quaternion."""
    factor = 2.0 * (len(q) - 1)
    left = factor * np.einsum("kab,ib->ika", PRODUCT, q[1:])
    right = factor * np.einsum("kab,ia->ikb", PRODUCT, q[:-1])
    return np.einsum("ika,ia->ik", left, q[:-1]), left, right


def _trapezoid(n: int) -> Array:
    """Weights (n + 1,) of the trapezoidal rule on [0, 1]."""
    weights = np.full(n + 1, 1.0 / n)
    weights[[0, -1]] *= 0.5
    return weights


def _constraints(q: Array, rod: _Rod) -> tuple[Array, Array]:
    """Values (m,) and Jacobian (m, n + 1, 4) of the constraints: chord (three), then kappa_2 of each segment."""
    n = len(q) - 1
    weights = _trapezoid(n)
    slope = 2.0 * np.einsum("i,kab,ib->kia", weights, TANGENT, q)
    values = [0.5 * np.einsum("kia,ia->k", slope, q) - rod.chord]
    rows = [slope]
    if rod.unbendable:
        strain, left, right = _strains(q)
        segment = np.arange(n)
        row = np.zeros((n, n + 1, 4))
        row[segment, segment] = left[:, 1] / n
        row[segment, segment + 1] = right[:, 1] / n
        values.append((strain[:, 1] - rod.rest[1]) / n)
        rows.append(row)
    return np.concatenate(values), np.concatenate(rows)


def _lagrangian(q: Array, multipliers: Array, rod: _Rod) -> tuple[Array, Array]:
    """Gradient (n + 1, 4) and Hessian (n + 1, 4, n + 1, 4) of `E + multipliers . constraints` in the quaternions."""
    n = len(q) - 1
    h, segment, node = 1.0 / n, np.arange(n), np.arange(n + 1)
    strain, left, right = _strains(q)
    moment = (strain - rod.rest) * rod.stiffness
    if rod.unbendable:
        moment[:, 1] = multipliers[3:]
    gradient = np.zeros((n + 1, 4))
    gradient[:-1] += h * np.einsum("ik,ika->ia", moment, left)
    gradient[1:] += h * np.einsum("ik,ika->ia", moment, right)
    hessian = np.zeros((n + 1, 4, n + 1, 4))
    hessian[segment, :, segment, :] += h * np.einsum("k,ika,ikb->iab", rod.stiffness, left, left)
    hessian[segment + 1, :, segment + 1, :] += h * np.einsum("k,ika,ikb->iab", rod.stiffness, right, right)
    cross = h * np.einsum("k,ika,ikb->iab", rod.stiffness, left, right)
    cross += 2.0 * np.einsum("ik,kab->iab", moment, PRODUCT)
    hessian[segment, :, segment + 1, :] += cross
    hessian[segment + 1, :, segment, :] += cross.transpose(0, 2, 1)
    # int X ds = X(0) + int (1 - s) d3 ds, so the load acts on d3 with the lever 1 - s.
    pull = multipliers[:3] - (1.0 - node / n)[:, None] * rod.load
    curvature = 2.0 * np.einsum("i,ik,kab->iab", _trapezoid(n), pull, TANGENT)
    gradient += np.einsum("iab,ib->ia", curvature, q)
    hessian[node, :, node, :] += curvature
    return gradient, hessian


def _reduced(q: Array, multipliers: Array, rod: _Rod) -> tuple[Array, Array, Array, Array, Array]:
    """The problem in rotations of the inner nodes: gradient (N,), Hessian (N, N), values (m,), Jacobian (m, N), basis.

    A rotation `theta` moves q by q o (0, theta) / 2, whose basis (n - 1, 3, 4) is returned too. On the unit sphere
    the Hessian gains minus the radial part of the gradient.
    """
    size = 3 * (len(q) - 2)
    gradient, hessian = _lagrangian(q, multipliers, rod)
    node = np.arange(len(q))
    radial = np.einsum("ia,ia->i", gradient, q)
    hessian[node, :, node, :] -= radial[:, None, None] * np.eye(4)
    basis = 0.5 * np.einsum("kab,ia->ikb", PRODUCT, q[1:-1])
    half = np.einsum("ika,iajb->ikjb", basis, hessian[1:-1, :, 1:-1])
    matrix = np.einsum("ikjb,jlb->ikjl", half, basis).reshape(size, size)
    values, jacobian = _constraints(q, rod)
    rows = np.einsum("cia,ika->cik", jacobian[:, 1:-1], basis).reshape(len(values), size)
    return np.einsum("ika,ia->ik", basis, gradient[1:-1]).ravel(), matrix, values, rows, basis


def _split(jacobian: Array) -> tuple[Array, Array, int]:
    """A right inverse (N, m), an orthonormal basis (N, k) of the null space, and the rank deficiency of `jacobian`.

    From the QR factors of its transpose with column pivoting. Dependent rows have zeros in the inverse.
    """
    from scipy.linalg import qr, solve_triangular

    factor, triangle, order = qr(jacobian.T, pivoting=True)
    sizes = np.abs(np.diagonal(triangle))
    rank = int(np.sum(sizes > RANK_TOLERANCE * sizes[0]))
    inverse = np.zeros(jacobian.T.shape)
    inverse[:, order[:rank]] = solve_triangular(triangle[:rank, :rank], factor[:, :rank].T).T
    return inverse, factor[:, rank:], len(sizes) - rank


def _discrete_spectrum(q: Array, rod: _Rod, pull: Array) -> _Spectrum:
    """Eigenvalues at the discrete equilibrium near `q` (n + 1, 4).

    Newton's method; multipliers that the constraints leave free (of a straight rod) stay as `pull` (3,) has them.
    """
    n = len(q) - 1
    start = q
    multipliers = np.zeros(3 + n if rod.unbendable else 3)
    multipliers[:3] = pull
    residual = np.inf
    for _ in range(MAX_NEWTON):
        gradient, hessian, values, jacobian, basis = _reduced(q, multipliers, rod)
        inverse, null, deficiency = _split(jacobian)
        if residual == np.inf:
            correction = inverse.T @ gradient
            multipliers -= correction
            gradient, hessian, values, jacobian, basis = _reduced(q, multipliers, rod)
        previous, residual = residual, float(max(np.abs(gradient).max(), np.abs(values).max()))
        on_null = null.T @ hessian @ null
        if residual < NEWTON_TOLERANCE or not residual < 1e3 * previous:
            break
        step = -inverse @ values
        step -= null @ np.linalg.solve(on_null, null.T @ (gradient + hessian @ step))
        multipliers -= inverse.T @ (gradient + hessian @ step)
        moved = q.copy()
        moved[1:-1] += np.einsum("ik,ika->ia", step.reshape(-1, 3), basis)
        q = moved / np.linalg.norm(moved, axis=1)[:, None]
    eigenvalues = np.asarray(n * np.linalg.eigvalsh(on_null), dtype=np.float64)
    return _Spectrum(eigenvalues, residual, deficiency, float(np.abs(q - start).max()))


def _resample(s: Array, quaternion: Array, strain: Array, n: int) -> Array:
    """Unit quaternions (n + 1, 4) at equal spacing: cubic Hermite interpolation with q' from the strain."""
    from scipy.interpolate import CubicHermiteSpline

    flips = np.where(np.einsum("ia,ia->i", quaternion[:-1], quaternion[1:]) < 0.0, -1.0, 1.0)
    q = quaternion * np.cumprod(np.append(1.0, flips))[:, None]
    # q' = q o (0, strain) / 2, and q . PRODUCT[k] r = r . (q o e_k).
    slope = 0.5 * np.einsum("kab,ia,ik->ib", PRODUCT, q, strain)
    nodes = CubicHermiteSpline(s, q, slope)(np.linspace(0.0, 1.0, n + 1))
    unit: Array = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    return unit


def _space_force(q: Array, force: Array) -> Array:
    """The space components of `force` (3,), given in the directors of the unit quaternion `q` (4,)."""
    scalar, vector = q[0], q[1:]
    turned: Array = force + 2.0 * np.cross(vector, np.cross(vector, force) + scalar * force)
    return turned


def second_variation_index(
    s: npt.ArrayLike,
    quaternion: npt.ArrayLike,
    position: npt.ArrayLike,
    strain: npt.ArrayLike,
    law: LinearLaw | Rested,
    *,
    force: npt.ArrayLike | None = None,
    load: npt.ArrayLike = (0.0, 0.0, 0.0),
    segments: int = 100,
) -> SecondVariationResult:
    """Morse index of the equilibrium of a rod clamped at both ends, by the inertia of its second variation.

    Parameters
    ----------
    s : array_like, shape (K,)
        Increasing, from 0 to 1.
    quaternion, position, strain : array_like, shapes (K, 4), (K, 3), (K, 3)
        The state at `s`; strain = (k1, k2, tau). Of the positions only the ends matter.
    law : LinearLaw, or Rested around one
        Stiffnesses of the rod, and its strain without load.
    force : array_like, shape (3,), optional
        Body components at s = 0 [GJ/L^2]. Needed for a straight rod only, whose shape does not determine it.
    load : array_like, shape (3,)
        Dead load per length f, in space [GJ/L^3]: N' = -f.
    segments : int
        Finest discretization, a multiple of 4. Twenty per wave length are ample.

    Returns
    -------
    SecondVariationResult

    Raises
    ------
    ValueError
        If a shape or a number is not as described.
    """
    s, q = as_array("s", s), as_array("quaternion", quaternion)
    x, w = as_array("position", position), as_array("strain", strain)
    if s.ndim != 1 or s.size < 2 or s[0] != 0.0 or s[-1] != 1.0 or np.any(np.diff(s) <= 0.0):
        raise ValueError(f"s: expected an increasing sequence from 0 to 1, got {np.array2string(s, threshold=6)}")
    for name, field, width in (("quaternion", q, 4), ("position", x, 3), ("strain", w, 3)):
        if field.shape != (s.size, width) or not np.all(np.isfinite(field)):
            raise ValueError(f"{name}: expected finite numbers of shape ({s.size}, {width}), got {field.shape}")
    if segments % 4 or segments < 16:
        raise ValueError(f"segments: expected a multiple of 4, at least 16, got {segments}")
    f = np.asarray(load, np.float64)
    linear, rest = (law.law, law.rest) if isinstance(law, Rested) else (law, (0.0, 0.0, 0.0))
    check_type("law", linear, LinearLaw, "a LinearLaw such as LinearLaw(0.625)")
    assert isinstance(linear, LinearLaw)
    stiffness = np.where(linear.rigid, 0.0, linear.stiffness)
    rod = _Rod(stiffness, x[-1] - x[0], f, np.array(rest, dtype=float), linear.rigid[1])
    start = np.zeros(3) if force is None else _space_force(q[0], np.asarray(force, np.float64))
    # The multiplier of the chord is -N(1) = f - N(0).
    meshes = (segments // 4, segments // 2, segments)
    return _extrapolated([_discrete_spectrum(_resample(s, q, w, n), rod, f - start) for n in meshes])


def _extrapolated(levels: list[_Spectrum]) -> SecondVariationResult:
    """Richardson's extrapolation of the eigenvalues (errors h^2, h^4) and the verdict on them."""
    coarse, medium, fine = (level.eigenvalues for level in levels)
    _, residual, deficiency, departure = levels[-1]
    keep = coarse.size
    second, fourth = (4.0 * medium[:keep] - coarse) / 3.0, (4.0 * fine[:keep] - medium[:keep]) / 3.0
    values = np.sort((16.0 * fourth - second) / 15.0)
    nearest = int(np.argmin(np.abs(values)))
    smallest, error = float(values[nearest]), float(np.abs(values - np.sort(fourth))[nearest])
    index, reason = int(np.sum(values < 0.0)), ""
    if not (residual < CONVERGED and departure < MAX_DEPARTURE):
        index, reason = -1, "No equilibrium of the discrete rod is near the sampled state: use more segments."
    elif max(x.residual for x in levels) > CONVERGED or max(x.departure for x in levels) > COARSE_DEPARTURE:
        index, reason = int(np.sum(fine < 0.0)), "The coarse meshes are too coarse to extrapolate: use more segments."
    elif abs(smallest) < error:
        reason = "An eigenvalue is zero to within its error: a fold or branch point is near; use more segments."
    elif deficiency:
        reason = f"The end conditions lose rank {deficiency} (a straight rod): not a regular state."
    return SecondVariationResult(index, values[:8], smallest, error, departure, deficiency, not reason, reason)
