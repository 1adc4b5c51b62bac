"""Families of branches at a multiple branch point, as declared continuous symmetries make them.

A generator that leaves the state of the point alone acts on the kernel as a matrix. Zeros of the reduced map that it
moves lie on orbits; of each orbit one member is confirmed, with the phase conditions of a state on it.
"""

from __future__ import annotations

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.newton import NewtonOptions, newton
from rodatlas.continuation.discrete.phase import MOVED, fitted, orbit_directions, velocity, with_phases
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.singular.kernel import Kernel, combined

DIFFERENCE = 1e-4  # distance over which the velocity is differenced
ON_SPHERE = NewtonOptions(tolerance=1e-9, max_iterations=10)  # near the point round-off is large
TURNS = 1e-3  # velocity of a unit vector of the kernel that is none


def actions(kernel: Kernel) -> list[np.ndarray]:
    """Matrices (d + 1, d + 1) of the generators that leave the state alone, on coordinates of the kernel."""
    colloc, x = kernel.colloc, kernel.state
    count = len(colloc.bvp.generators)
    if not count:
        return []
    at = [velocity(colloc, x, i) for i in range(count)]
    squares, factors = np.linalg.eigh(np.array([[colloc.inner(v, w) for w in at] for v in at]))
    matrices = np.zeros((count, len(kernel.vectors), len(kernel.vectors)))
    for j, v in enumerate(kernel.vectors):
        ahead, behind = (add(x, (sign * DIFFERENCE, v)) for sign in (1.0, -1.0))
        for i in range(count):
            change = add(velocity(colloc, ahead, i), (-1.0, velocity(colloc, behind, i)))
            matrices[i, :, j] = [colloc.inner(w, change) / (2 * DIFFERENCE) for w in kernel.vectors]
    limit = MOVED * max(1.0, float(np.sqrt(max(squares[-1], 0.0))))
    return [np.tensordot(factors[:, i], matrices, 1) for i in range(count) if np.sqrt(max(squares[i], 0.0)) <= limit]


def is_at_rest(kernel: Kernel) -> bool:
    """Whether a free parameter that a phase condition determines, such as a period, has no effect at the point."""
    colloc = kernel.colloc
    determined = colloc.bvp.phases - colloc.bvp.unfoldings
    return determined > 0 and len(orbit_directions(colloc, kernel.state)) < determined


def moves(matrices: list[np.ndarray], u: np.ndarray) -> np.ndarray:
    """Which directions (P, d + 1) of the kernel the generators move."""
    return np.any([np.linalg.norm(u @ m.T, axis=1) > TURNS for m in matrices], axis=0)


def member(kernel: Kernel, near: Columns, radius: float) -> tuple[np.ndarray, Columns] | None:
    """Direction (d + 1,) at the point, and a state at a distance, of the branch near a state that the symmetries move.

    None when Newton finds none there. The direction is extrapolated from that at half the distance.
    """
    old = kernel.colloc
    own = old.free[: len(old.free) - old.bvp.unfoldings].tolist()
    inside, free = with_phases(old.bvp.plain, len(orbit_directions(old, near)), own)
    new = Collocation(inside, old.mesh, old.scheme.points, old.base, free, old.scale, old.backend)
    vectors = [fitted(v, len(free)) for v in kernel.vectors]
    origin, x = fitted(kernel.state, len(free)), fitted(near, len(free))

    def coordinates(y: Columns) -> np.ndarray:
        dx = add(y, (-1.0, origin))
        return np.array([new.inner(v, dx) for v in vectors])

    units, first = [], x
    for size in (radius, radius / 2):

        def sphere(y: Columns, size: float = size) -> tuple[float, Row]:
            a = coordinates(y)
            length = float(np.linalg.norm(a))
            return length - size, new.row(combined(vectors, a / length))

        new.hold(x)
        found = newton(new, x, [sphere], ON_SPHERE)
        if not found.converged or new.norm(add(found.state, (-1.0, x))) > 0.3 * size:
            return None
        a = coordinates(found.state)
        units.append(a / np.linalg.norm(a))
        first = found.state if size == radius else first
        x = add(origin, (0.5, add(found.state, (-1.0, origin))))
    limit = 2 * units[1] - units[0]
    return limit / np.linalg.norm(limit), fitted(first, len(old.free))
