r"""Critical modes: the variations of an equilibrium for which the energy changes least to second order.

With rotations theta of the cross-sections in space, and end poses held, the second variation of the energy has
eigenvalues mu and modes theta,

.. math:: \delta^2 E[\theta, \cdot] = \mu \int_0^1 \theta \cdot (\cdot)\, ds .

Their number below zero is the Morse index; mu = 0 at a fold or a branch point, where the mode is the kernel. They are
solutions of the equations of :mod:`rodatlas.rods.conjugate_points` with `D - mu I` in place of D and theta = xi = 0 at
both ends. The inverse T of the second variation takes f to the theta that solves them with `p' = ... - f` instead: it
is symmetric, with eigenvalues 1/mu. The largest are found by subspace iteration, each application of T being one sparse
solution of the Gauss collocation equations on the mesh of the equilibrium.

Source: H. Rutishauser (1970), Numer. Math. 16, 205 (subspace iteration with the projected eigenvalue problem).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from rodatlas.continuation import Solution
from rodatlas.continuation.linear.gauss import gauss_scheme
from rodatlas.continuation.symmetric.isotropy import isotropy
from rodatlas.rods.conjugate_points import jacobi_coefficients
from rodatlas.rods.formulation import Sections, parameters_of
from rodatlas.rods.kinematics import directors
from rodatlas.rods.perfectly_anisotropic import FULL, check_rod, rod_problem
from rodatlas.rods.state import RodState

Array = npt.NDArray[np.float64]

# Order of the twelve unknowns: p (0-2), theta (3-5), eta (6-8), xi (9-11), body components.
MOMENT, TURN, FORCE, SHIFT = (slice(3 * i, 3 * i + 3) for i in range(4))
SPARE = 4  # vectors iterated beyond those that are wanted; they set the rate of convergence
CONVERGED = 1e-10  # change of the eigenvalues in one iteration, relative to the distance to the next one
MOST_ITERATIONS = 200
SYMMETRIC = 1e-2  # difference of a mode from its image (interpolated), relative to the mode, that counts as none
PARITIES = {  # signs of the space components of rotation and displacement under each symmetry of the band
    "reversal": ((-1.0, 1.0, -1.0), (-1.0, 1.0, -1.0)),
    "angle mirror": ((-1.0, 1.0, -1.0), (1.0, -1.0, 1.0)),
    "shear mirror": ((-1.0, -1.0, 1.0), (1.0, 1.0, -1.0)),
}


@dataclass(frozen=True, eq=False)
class Mode:
    """One mode of the second variation of a rod's energy.

    Attributes
    ----------
    solution : the equilibrium.
    eigenvalue : mu [GJ/L^2]; zero at a bifurcation.
    s : (K,) mesh points of the equilibrium.
    rotation : (K, 3) rotation vectors of the sections, space components [rad].
    displacement : (K, 3) of the centerline, space components; the largest has length 1.
    breaks : names of the symmetries of the equilibrium that the mode does not have: a branch along it loses them.
    """

    solution: Solution
    eigenvalue: float
    s: Array
    rotation: Array
    displacement: Array
    breaks: tuple[str, ...]
    _body: _Fields = field(repr=False)

    def __repr__(self) -> str:
        lost = f", breaks {', '.join(self.breaks)}" if self.breaks else ""
        return f"Mode(eigenvalue {self.eigenvalue:.6g}{lost})"

    def moved(self, amplitude: float) -> Solution:
        """The band moved along the mode: every unknown changed in proportion, the quaternions by whole rotations.

        An equilibrium to first order when the eigenvalue is zero: the side branch of a pitchfork begins like this. Its
        parameters and observables are those of the equilibrium.

        Parameters
        ----------
        amplitude : largest displacement, in units of the length.
        """
        solution, count = self.solution, self.solution.stages.shape[-1]
        values = _moved(solution, solution.values, self._body.mesh * amplitude)
        flat = _moved(solution, solution.stages.reshape(-1, count), self._body.stage.reshape(-1, 12) * amplitude)
        return replace(solution, values=values, stages=flat.reshape(solution.stages.shape))


class _Fields(NamedTuple):
    """The twelve unknowns at mesh points (N+1, 12) and Gauss points (N, m, 12)."""

    mesh: Array
    stage: Array


def critical_mode(solution: Solution) -> Mode:
    """The mode whose eigenvalue is nearest to zero: at a simple fold or branch point, the kernel.

    Parameters
    ----------
    solution : of :func:`rodatlas.rods.perfectly_anisotropic.rod_problem`.

    Raises
    ------
    ValueError
        when the modes cannot be computed (see :func:`critical_modes`).
    """
    check_rod(solution)
    return critical_modes(solution, 1)[0]


def critical_modes(solution: Solution, count: int = 1) -> tuple[Mode, ...]:
    """The modes whose eigenvalues are nearest to zero, in order of their size.

    Where several vanish at once (a symmetric state without shear), any basis of their span may be returned.

    Raises
    ------
    ValueError
        when `count` is not positive, or the eigenvalues do not converge, which a straight or nearly straight rod can
        cause.
    """
    check_rod(solution)
    if not 1 <= count <= 20:
        raise ValueError(f"count: expected 1 to 20, got {count}")
    inverse = _Inverse(solution)
    values, fields = _subspace(inverse, solution, count)
    own = isotropy(rod_problem(), solution)
    return tuple(_mode(solution, mu, f, own) for mu, f in zip(values, fields, strict=True))


class _Inverse:
    """T: a moment per length f to the fields that it causes in the rod with both ends held."""

    def __init__(self, solution: Solution):
        from scipy.sparse.linalg import splu

        scheme = gauss_scheme(solution.points)
        self._h = np.diff(solution.mesh)
        self._m, self._left, self._ends = solution.points, scheme.c_left, scheme.c_stage
        slope = np.kron(scheme.d, np.eye(12))[None] / self._h[:, None, None]
        rates = _rates(solution)
        count = self._m * 12
        for j in range(self._m):
            slope[:, 12 * j : 12 * j + 12, 12 * j : 12 * j + 12] -= rates[:, j]
        start = -np.kron(scheme.d0[:, None], np.eye(12))[None] / self._h[:, None, None]
        # stages = follow @ left value + answer @ source at the stages
        self._answer = np.linalg.inv(slope)
        self._follow = self._answer @ np.broadcast_to(start, (len(self._h), count, 12))
        step = self._left * np.eye(12) + np.einsum("j,njab->nab", self._ends, self._follow.reshape(-1, self._m, 12, 12))
        self._solve = splu(_ends_held(step)).solve

    def __call__(self, f: Array) -> _Fields:
        """Fields for f (N, m, 3) at the Gauss points, body components."""
        n = len(self._h)
        source = np.zeros((n, self._m, 12))
        source[..., MOMENT] = -f
        forced = np.einsum("nab,nb->na", self._answer, source.reshape(n, -1))
        jump = np.einsum("j,nja->na", self._ends, forced.reshape(n, self._m, 12))
        right = np.concatenate([np.zeros(6), jump.ravel(), np.zeros(6)])
        mesh = self._solve(right).reshape(n + 1, 12)
        stage = np.einsum("nab,nb->na", self._follow, mesh[:-1]) + forced
        return _Fields(mesh, stage.reshape(n, self._m, 12))


def _rates(solution: Solution) -> Array:
    """Matrices (N, m, 12, 12) of the linear equations at the Gauss points."""
    shape = solution.stages.shape[:2]
    state = RodState(solution).at_gauss_points()
    force, moment, strain = (x.reshape(-1, 3) for x in (state.force_body, state.moment_body, state.strain))
    rotation, spin = jacobi_coefficients(force, moment, strain, state.compliance.reshape(-1, 3, 3))
    e3 = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    rates = np.zeros((len(spin), 12, 12))
    rates[:, :6, :6] = rotation
    rates[:, FORCE, FORCE] = rates[:, SHIFT, SHIFT] = spin
    rates[:, MOMENT, FORCE] = rates[:, SHIFT, TURN] = -e3
    return rates.reshape(*shape, 12, 12)


def _ends_held(step: Array) -> object:
    """The sparse matrix of theta = xi = 0 at s = 0, y_(i+1) - step_i y_i for all i, and theta = xi = 0 at s = 1."""
    from scipy.sparse import bmat, csc_matrix, eye

    n = len(step)
    held = np.vstack([np.eye(12)[TURN], np.eye(12)[SHIFT]])
    rows: list[list[object]] = [[None] * (n + 1) for _ in range(n + 2)]
    rows[0][0], rows[-1][-1] = csc_matrix(held), csc_matrix(held)
    for i in range(n):
        rows[i + 1][i], rows[i + 1][i + 1] = csc_matrix(-step[i]), eye(12, format="csc")
    return bmat(rows, format="csc")


def _subspace(inverse: _Inverse, solution: Solution, count: int) -> tuple[Array, list[_Fields]]:
    """Eigenvalues (count,) nearest to zero and their fields, by subspace iteration."""
    size = count + SPARE
    weights = np.sqrt(np.outer(np.diff(solution.mesh), gauss_scheme(solution.points).weights))[..., None]
    # waves in every component to begin with, so that no symmetry is left out
    s = solution.gauss_points()[..., None]
    phase = np.arange(3) + 0.3
    start = [np.sin((k + 1) * np.pi * s + phase * k) for k in range(size)]
    before = np.full(count, np.inf)
    for _ in range(MOST_ITERATIONS):
        basis = np.linalg.qr(np.column_stack([(weights * f).ravel() for f in start]))[0]
        images = [inverse(basis[:, k].reshape((*weights.shape[:2], 3)) / weights) for k in range(size)]
        turned = np.column_stack([(weights * y.stage[..., TURN]).ravel() for y in images])
        ritz, mix = np.linalg.eigh(0.5 * (basis.T @ turned + turned.T @ basis))
        order = np.argsort(-np.abs(ritz))
        values = 1.0 / ritz[order]
        start = [sum(c * y.stage[..., TURN] for c, y in zip(mix[:, k], images, strict=True)) for k in order]
        if np.abs(values[:count] - before).max() < CONVERGED * abs(values[count]):
            meshes, stages = np.array([y.mesh for y in images]), np.array([y.stage for y in images])
            mixed = [_Fields(np.tensordot(mix[:, k], meshes, 1), np.tensordot(mix[:, k], stages, 1)) for k in order]
            return values[:count], mixed[:count]
        before = values[:count]
    raise ValueError(f"solution: expected a rod whose modes can be told apart, got {solution!r}")


def _mode(solution: Solution, mu: float, fields: _Fields, own: tuple[str, ...]) -> Mode:
    """The mode of given fields, scaled and read in space."""
    frame = RodState(solution).directors
    displacement = np.einsum("kd,kda->ka", fields.mesh[:, SHIFT], frame)
    rotation = np.einsum("kd,kda->ka", fields.mesh[:, TURN], frame)
    largest = displacement[np.argmax(np.linalg.norm(displacement, axis=1))]
    scale = np.copysign(1.0 / np.linalg.norm(largest), largest[np.argmax(np.abs(largest))])
    body = _Fields(scale * fields.mesh, scale * fields.stage)
    breaks = tuple(name for name in own if not _kept(name, solution.mesh, scale * rotation, scale * displacement))
    return Mode(solution, float(mu), solution.mesh, scale * rotation, scale * displacement, breaks, body)


def _kept(name: str, s: Array, rotation: Array, displacement: Array) -> bool:
    """Whether a mode equals its image under a symmetry; sampled at the mesh points and their mirror images."""
    from scipy.interpolate import CubicSpline

    fields = np.hstack([rotation, displacement])
    image = CubicSpline(s, fields)(1.0 - s) if name == "reversal" else fields
    image = image * np.concatenate(PARITIES[name])
    return bool(np.abs(image - fields).max() < SYMMETRIC * np.abs(fields).max())


def _moved(solution: Solution, values: Array, change: Array) -> Array:
    """Unknowns (K, n) changed along the fields (K, 12): dN = eta + N x theta, dM = p + M x theta / 2."""
    old, turn = FULL.sections(solution, values), change[:, TURN]
    force = old.force + change[:, FORCE] + np.cross(old.force, turn)
    moment = old.moment + change[:, MOMENT] + 0.5 * np.cross(old.moment, turn)
    frame = np.stack(directors(old.quaternion), axis=1)
    position = old.position + np.einsum("kd,kda->ka", change[:, SHIFT], frame)
    parameters = parameters_of(solution)
    new = Sections.loaded(FULL.law(parameters), force, moment, _turned(old.quaternion, turn), position)
    return FULL.values(new, parameters)


def _turned(q: Array, turn: Array) -> Array:
    """Quaternions (K, 4) after rotations by the vectors `turn` (K, 3), body components: q o exp(turn / 2)."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    scalar, vector = np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * turn
    q0, v = q[:, :1], q[:, 1:]
    dot = np.einsum("ka,ka->k", v, vector)[:, None]
    return np.hstack([q0 * scalar - dot, q0 * vector + scalar * v + np.cross(v, vector)])
