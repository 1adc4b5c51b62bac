"""Morse index of a rod equilibrium from its conjugate points.

The equations
-------------
Let an equilibrium have strain w = (k1, k2, tau), force N and moment M, in body components. Turn its
cross-sections by `theta` and displace them by `xi`, and let `eta` be the change of the force vector and `p` that
of the moment vector less `theta x M / 2`. With [v] u = v x u, e3 = (0, 0, 1) and C the Hessian of the
complementary energy, so that the change of strain is C times the change of the body components of M::

    p'     = (-[w] + [M] C / 2) p + D theta - [e3] eta        eta' = -[w] eta
    theta' = C p + (-[w] + C [M] / 2) theta                   xi'  = -[w] xi - [e3] theta
    D      = N3 I - (e3 N^T + N e3^T) / 2 + [M] C [M] / 4

D is symmetric: the system is Hamiltonian in the coordinates q = (theta, xi) with momenta (p, eta). (The body
components alone, dM = p + M x theta / 2 and dN = eta + N x theta, do not form canonical pairs.) A dead load
enters through N and M only.

The solutions with q(0) = 0 span a Lagrangian plane L(s). A conjugate point is an s at which L(s) meets
V = {q = 0}; its multiplicity is the dimension of the intersection. The Morse index, the number of independent
variations that lower the energy with the end poses held, is the number of conjugate points in (0, 1). The
equilibrium is stable if there is none in (0, 1].

The count
---------
Each step is one step of a Gauss method. It is symplectic, so L stays Lagrangian and the result is the exact index
of a discrete quadratic form. L is held as an orthonormal frame, so nothing overflows. Since C >= 0, L crosses V
in one sense only, and the crossings in a step with map S are, multiplicity included, the difference of two
signatures of 6 x 6 forms: the number of directions of the new L between V and an auxiliary plane U, less those
between S V and U. U is chosen clear of L. The step must be short enough to leave S V near V, but L may turn as far
as it likes: double zeros and zeros that nearly coincide need no resolution.

Sources: T. Bretl and Z. McCarthy (2014), Int. J. Robotics Res. 33, 48; R. S. Manning, K. A. Rogers and
J. H. Maddocks (1998), Proc. R. Soc. A 454, 3047; W. Kratz (2003), J. Differ. Equ. Appl. 9, 135 (focal points of
discrete symplectic systems).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from rodatlas.continuation.checks import as_array

Array = npt.NDArray[np.float64]

STAGES = 3
# The count takes angles above minus this (radians) for non-negative; round-off in the frames is about 1e-14.
COUNT_TOLERANCE = 1e-9
# In the count, angles are those of units in which momenta are larger by this factor. It makes S V stay near V.
STRETCH = 4.0
# A step of length h turns a wave of wave number k by too little or too much by (hk)^7 / 100800, the error of the
# diagonal Pade approximant: (m!)^2 / ((2m)! (2m+1)!) with m = 3. Couplings make the angle of L(1) worse. With
# this factor no count called safe was wrong in 900 random rods (25 to 100 steps, up to 100 conjugate points).
SAFETY = 200.0
# The largest growth exponent of a step, short of the pole of the approximant of exp at 4.6.
LONGEST_STEP = 3.0
# An error of the angles above this (radians) means too coarse a mesh. A margin below the error, or below the
# round-off of the fields, is degenerate.
COARSE_ERROR = 0.1
DEGENERATE_MARGIN = 1e-8
# The largest departure of a frame from a Lagrangian plane that is put down to round-off.
LAGRANGIAN_TOLERANCE = 1e-10


@dataclass(frozen=True)
class IndexResult:
    """Morse index of an equilibrium, and how far the count can be trusted.

    Attributes
    ----------
    index : int
        Number of conjugate points in (0, 1), with multiplicity; -1 if it could not be counted (see `reason`).
    margin : float
        Sine, in [0, 1], of the smallest angle between L(1) and {q = 0}, in units of the rod's own mean wave length
        and the moment that goes with it. It is 0 at a fold or a branch point. Directions that the ends do not
        control (see `uncontrolled`) are left out.
    conjugate_points : ndarray, shape (index,)
        Where they are, in increasing order and as often as their multiplicity: middles of the steps that hold them.
    uncontrolled : int
        Dimension of the end poses that no variation reaches to first order; 3 for a straight band, 1 for a straight
        isotropic rod, otherwise 0. The index is then that of the form on the reachable part.
    angle_error : float
        Cautious estimate of the error of the angle behind `margin` [rad].
    trusted : bool
        Whether nothing speaks against the count.
    reason : str
        What does, as a sentence; empty if `trusted`.
    """

    index: int
    margin: float
    conjugate_points: Array
    uncontrolled: int
    angle_error: float
    trusted: bool
    reason: str

    def __repr__(self) -> str:
        note = "" if self.trusted else f", not trusted: {self.reason}"
        return f"IndexResult(index={self.index}, margin={self.margin:.3g}{note})"


@lru_cache
def _gauss_method(stages: int) -> tuple[Array, Array, Array]:
    """Nodes c (m,) on [0, 1], Runge-Kutta matrix A (m, m) and g = b A^-1 (m,) of the Gauss method.

    A integrates polynomials exactly: `sum_j A_ij c_j^k = c_i^(k+1) / (k+1)` for k < m.
    """
    x, weights = np.polynomial.legendre.leggauss(stages)
    nodes = 0.5 * (x + 1.0)
    powers = np.arange(stages)
    values = nodes[:, None] ** powers
    integrals = nodes[:, None] ** (powers + 1) / (powers + 1)
    matrix = np.linalg.solve(values.T, integrals.T).T
    return nodes, np.ascontiguousarray(matrix), np.linalg.solve(matrix.T, 0.5 * weights)


def index_nodes(mesh: npt.ArrayLike, per_interval: int = 1) -> Array:
    """Nodes at which `morse_index` wants the fields: three Gauss points in each of `per_interval` parts per interval.

    Parameters
    ----------
    mesh : array_like, shape (n + 1,)
        Increasing, from 0 to 1; any spacing.
    per_interval : int
        Equal steps in each mesh interval.

    Returns
    -------
    ndarray, shape (3 n per_interval,)
    """
    edges = as_array("mesh", mesh)
    if edges.ndim != 1 or edges.size < 2 or edges[0] != 0.0 or edges[-1] != 1.0 or np.any(np.diff(edges) <= 0.0):
        got = np.array2string(edges, threshold=6)
        raise ValueError(f"mesh: expected an increasing sequence from 0 to 1, got {got}")
    if per_interval < 1:
        raise ValueError(f"per_interval: expected at least 1, got {per_interval}")
    steps = np.repeat(np.diff(edges) / per_interval, per_interval)
    parts = np.tile(np.arange(per_interval), edges.size - 1)
    starts = np.repeat(edges[:-1], per_interval) + parts * steps
    nodes: Array = (starts[:, None] + steps[:, None] * _gauss_method(STAGES)[0]).ravel()
    return nodes


def _steps_of(s: Array) -> tuple[Array, Array]:
    """Step lengths (n,) and edges (n + 1,) of the nodes `s` (3 n,) made by `index_nodes`."""
    c = _gauss_method(STAGES)[0]
    if s.ndim == 1 and s.size and s.size % STAGES == 0:
        rows = s.reshape(-1, STAGES)
        steps = (rows[:, -1] - rows[:, 0]) / (c[-1] - c[0])
        edges = np.append(rows[:, 0] - c[0] * steps, 1.0)
        predicted = edges[:-1, None] + steps[:, None] * c
        joined = np.abs(np.diff(edges) - steps).max() < 1e-9
        if joined and abs(edges[0]) < 1e-9 and np.abs(predicted - rows).max() < 1e-9 and steps.min() > 0.0:
            return steps, edges
    raise ValueError("s: expected nodes made by index_nodes (three Gauss points per step, from 0 to 1)")


def _cross_matrices(vectors: Array) -> Array:
    """The matrices [v] (K, 3, 3) of u -> v x u for `vectors` (K, 3)."""
    matrices = np.zeros((len(vectors), 3, 3))
    matrices[:, 2, 1], matrices[:, 0, 2], matrices[:, 1, 0] = vectors.T
    matrices[:, 1, 2], matrices[:, 2, 0], matrices[:, 0, 1] = -vectors.T
    return matrices


def jacobi_coefficients(force: Array, moment: Array, strain: Array, compliance: Array) -> tuple[Array, Array]:
    """Matrices of (p, theta) (K, 6, 6) and -[w] of eta and xi (K, 3, 3); see the module's equations."""
    spin = -_cross_matrices(strain)
    half_moment = 0.5 * _cross_matrices(moment)
    coupling = compliance @ half_moment
    stiffness = half_moment @ coupling
    stiffness[:, [0, 1, 2], [0, 1, 2]] += force[:, 2:]
    stiffness[:, 2, :] -= 0.5 * force
    stiffness[:, :, 2] -= 0.5 * force
    rotation = np.empty((len(force), 6, 6))
    rotation[:, :3, :3] = spin + half_moment @ compliance
    rotation[:, :3, 3:] = stiffness
    rotation[:, 3:, :3] = compliance
    rotation[:, 3:, 3:] = spin + coupling
    return rotation, spin


def _checked(s: Array, **fields: npt.ArrayLike) -> list[Array]:
    """The vector fields as finite float64 arrays of shape (K, 3)."""
    arrays = []
    for name, field in fields.items():
        array = as_array(name, field)
        if array.shape != (s.size, 3):
            raise ValueError(f"{name}: expected shape ({s.size}, 3), got {array.shape}")
        if not np.all(np.isfinite(array)):
            raise ValueError(f"{name}: expected finite numbers")
        arrays.append(array)
    return arrays


def _compliances(compliance: npt.ArrayLike, count: int) -> tuple[Array, bool]:
    """The compliance at every node (K, 3, 3), and whether it is positive semidefinite there."""
    matrix = as_array("compliance", compliance)
    if matrix.shape not in ((3, 3), (count, 3, 3)):
        raise ValueError(f"compliance: expected shape (3, 3) or ({count}, 3, 3), got {matrix.shape}")
    size = np.abs(matrix).max(initial=0.0)
    if not (np.isfinite(size) and size > 0.0):
        raise ValueError("compliance: expected finite numbers, not all zero")
    if np.abs(matrix - np.swapaxes(matrix, -1, -2)).max() > 1e-9 * size:
        raise ValueError("compliance: expected symmetric matrices")
    definite = bool(np.linalg.eigvalsh(matrix).min() >= -1e-9 * size)
    return np.broadcast_to(matrix, (count, 3, 3)), definite


def _angles_at_end(frame: Array) -> Array:
    """Sines (6,), decreasing, of the angles between the plane of `frame` (12, 6) and q = 0, without the stretch."""
    natural = frame.copy()
    natural[:6] /= STRETCH
    sines: Array = np.linalg.svd(np.linalg.qr(natural)[0][6:], compute_uv=False)
    return sines


def _angle_error(steps: Array, softness: float, force: Array, moment: Array, strain: Array) -> float:
    """Cautious estimate of the error of the angles of L(1) [rad], from local wave numbers; see `SAFETY`.

    Waves come from the least eigenvalue (N3 - |N|) / 2 of the part of D that holds the force: thrust makes
    waves, tension makes boundary layers. In a layer L follows its attracting plane and errors die out, unless the
    approximant comes near its pole at 4.6.
    """
    size = np.linalg.norm(force, axis=1)
    turn = np.maximum(np.linalg.norm(strain, axis=1), 0.5 * softness * np.linalg.norm(moment, axis=1))
    wave = np.sqrt(softness * 0.5 * (size - force[:, 2])) + turn
    layer = steps * (np.sqrt(softness * size) + turn).reshape(-1, STAGES).max(axis=1)
    if layer.max() > LONGEST_STEP:
        return float("inf")
    phase = steps * wave.reshape(-1, STAGES).max(axis=1)
    return SAFETY * float(np.sum(phase**7)) / 100800.0


def _doubt(too_long: int, defect: float, uncontrolled: int, margin: float, error: float) -> str:
    """Why a count is not safe, or an empty string."""
    if too_long or error > COARSE_ERROR:
        return "The steps are too long for the force and moment: use more per interval, or a finer mesh."
    if not defect < LAGRANGIAN_TOLERANCE:
        return f"Round-off has spoilt the frames (Lagrangian to {defect:.1e} only): use more steps per interval."
    if uncontrolled:
        return f"The ends do not control the pose in {uncontrolled} directions (a straight rod): not a regular state."
    if margin < max(error, DEGENERATE_MARGIN):
        return (
            f"The margin {margin:.1e} is within the error {error:.1e}: a fold or branch point is too near; "
            "use more steps per interval to tell on which side."
        )
    return ""


def morse_index(
    s: npt.ArrayLike,
    force: npt.ArrayLike,
    moment: npt.ArrayLike,
    strain: npt.ArrayLike,
    compliance: npt.ArrayLike,
) -> IndexResult:
    """Morse index of the equilibrium of a rod clamped at both ends, by counting conjugate points.

    Parameters
    ----------
    s : array_like, shape (K,)
        Nodes made by `index_nodes`.
    force, moment : array_like, shape (K, 3)
        Body components at the nodes [GJ/L^2, GJ/L].
    strain : array_like, shape (K, 3)
        (k1, k2, tau) at the nodes [1/L].
    compliance : array_like, shape (3, 3) or (K, 3, 3)
        Hessian of the complementary energy H(M) [1/GJ]; the row and column of a strain that cannot change are zero
        (k2 of a perfectly anisotropic rod: diag(1/a, 0, 1)).

    Returns
    -------
    IndexResult

    Raises
    ------
    ValueError
        If the nodes, a shape or a value is not as described.
    """
    from rodatlas.rods._conjugate_kernel import count_crossings

    s = as_array("s", s)
    steps, edges = _steps_of(s)
    force, moment, strain = _checked(s, force=force, moment=moment, strain=strain)
    compliance, definite = _compliances(compliance, s.size)
    if not definite:
        reason = "The compliance is not positive semidefinite: the energy is not convex, and no index is finite."
        return IndexResult(-1, 0.0, np.empty(0), 0, np.inf, False, reason)

    # Units of the rod: with softness c (mean of the two larger compliances) and wave number k, lengths by 1/k and
    # moments by k/c make every coefficient of order one; the stretch divides the unit of moment once more.
    _, tableau, weights = _gauss_method(STAGES)
    density = np.outer(steps, weights @ tableau).ravel()
    softness = 0.5 * float(density @ np.trace(compliance, axis1=1, axis2=2))
    wave = np.sqrt(softness * (density @ np.linalg.norm(force, axis=1))) + density @ np.linalg.norm(strain, axis=1)
    wave = max(float(wave), 1.0)
    error = _angle_error(steps, softness, force, moment, strain)
    softness *= STRETCH
    rotation, spin = jacobi_coefficients(
        force * (softness / wave**2), moment * (softness / wave), strain / wave, compliance / softness
    )
    counts, frame, uncontrolled, too_long, defect = count_crossings(
        steps * wave,
        tableau,
        weights,
        rotation.reshape(-1, STAGES, 6, 6),
        spin.reshape(-1, STAGES, 3, 3),
        COUNT_TOLERANCE,
    )
    if not np.all(np.isfinite(frame)) or counts.min() < 0:
        reason = "The count broke down: use more steps per interval."
        return IndexResult(-1, 0.0, np.empty(0), int(uncontrolled), error, False, reason)
    sines = _angles_at_end(frame)
    margin = float(sines[5 - uncontrolled]) if uncontrolled < 6 else 0.0
    doubt = _doubt(too_long, defect, uncontrolled, margin, error)
    points = np.repeat(0.5 * (edges[1:] + edges[:-1]), counts)
    return IndexResult(int(counts.sum()), margin, points, int(uncontrolled), error, not doubt, doubt)
