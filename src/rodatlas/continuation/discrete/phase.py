r"""Phase conditions: they hold one member of the orbit along which a continuous symmetry moves a state.

Where a generator moves the state x, its velocity :math:`\xi(x)` lies in the kernel of F' all along a branch, and a left
vector :math:`\psi` with :math:`\psi^T F' = 0` belongs to it. With a reference :math:`x_0` near x,

.. math:: F(x) + \sum_i \varepsilon_i b_i = 0, \qquad \langle \xi_i, x - x_0 \rangle = 0,

is regular where the branch is regular apart from the group, if the columns b are these left vectors at the reference.
(The generator itself would not do: where a variational principle stands behind F, :math:`\psi \cdot \xi = 0`.)
Solutions that obey the conditions solve the system with :math:`\varepsilon = 0`, so there are no others near by.

The velocities at the reference are made orthonormal; where several generators move the state in the same directions,
as turning and shifting a plane wave do, there are as many conditions as directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.discrete.random_fields import displacement, smooth_load
from rodatlas.continuation.discrete.solution import Interpolation
from rodatlas.continuation.linear.gauss import lagrange_basis
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.problem.evaluator import evaluator

if TYPE_CHECKING:
    from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Scale
    from rodatlas.continuation.discrete.solution import Solution
    from rodatlas.continuation.problem.bvp import BVP

MOVED = 1e-6  # velocity, in scaled variables, below which a state is one that a generator leaves alone
ATTEMPTS = 4  # borders tried to find left vectors
TERMS = 3  # of a smooth random border


@dataclass(frozen=True, eq=False)
class Phase:
    """Phase conditions on one mesh.

    Attributes
    ----------
    directions : orthonormal velocities xi_i at the reference, scaled, with as many scalars as free parameters.
    values : <xi_i, x_0>.
    columns : b_i, of length one in the mesh-independent norm of residuals per length.
    """

    directions: tuple[Columns, ...]
    values: tuple[float, ...]
    columns: tuple[Blocks, ...]

    def added(self, colloc: Collocation, x: Columns, lin: Linearization) -> Linearization:
        """The linearisation with the columns of the unfolding parameters, and the conditions as last integrals."""
        first = len(lin.residual.dense) - len(self.directions)
        stage, ends, dense = (a.copy() for a in (lin.residual.stage, lin.residual.ends, lin.residual.dense))
        stage_scal, b_scal = lin.stage_scal.copy(), lin.b_scal.copy()
        weights, dense_scal = lin.dense.copy(), lin.dense_scal.copy()
        for j, column in zip(colloc.unfolding_scalars, self.columns, strict=True):
            epsilon = float(x.scalars[j])
            stage += epsilon * column.stage
            ends += epsilon * column.ends
            dense += epsilon * column.dense
            stage_scal[:, :, j] += column.stage.reshape(stage_scal.shape[:2])
            b_scal[:, j] += column.ends
            dense_scal[:, j] += column.dense
        for i, (direction, value) in enumerate(zip(self.directions, self.values, strict=True)):
            row = colloc.row(direction)
            assert row.stage is not None
            weights[first + i], dense_scal[first + i] = row.stage, row.scalars
            dense[first + i] = row.dot(x) - value
        residual = replace(lin.residual, stage=stage, ends=ends, dense=dense)
        return replace(
            lin, residual=residual, stage_scal=stage_scal, b_scal=b_scal, dense=weights, dense_scal=dense_scal
        )  # fmt: skip

    def on(self, old: Collocation, new: Collocation) -> Phase:
        """The same conditions on another mesh."""
        carry = old.carrier(new)
        columns = tuple(_carried(old, new, column) for column in self.columns)
        return Phase(tuple(carry(v) for v in self.directions), self.values, columns)


def phased(
    bvp: BVP, solution: Solution, free: Sequence[int], scale: Scale | None = None, controls: int = 1
) -> tuple[BVP, list[int]]:
    """The problem with as many phase conditions as a state needs, and its free parameters.

    Parameters
    ----------
    bvp : BVP, the user's; free : indices of its free parameters; controls : as for :func:`with_phases`.
    """
    return with_phases(bvp, moved_in(bvp, solution, free, scale), free, controls)


def moved_in(bvp: BVP, solution: Solution, free: Sequence[int], scale: Scale | None = None) -> int:
    """In how many directions the continuous symmetries move a solution."""
    if not bvp.generators:
        return 0
    from rodatlas.continuation.discrete.collocation import Collocation

    colloc = Collocation.at(bvp, solution, free, scale)
    return len(orbit_directions(colloc, colloc.state(solution)))


def with_phases(bvp: BVP, count: int, free: Sequence[int], controls: int = 1) -> tuple[BVP, list[int]]:
    """The user's problem with some phase conditions, and its free parameters.

    Each condition determines a free parameter beyond those of the problem itself, as the period of a limit cycle, or an
    unfolding parameter. On a branch one parameter stays undetermined, on a locus two `controls`.

    Raises
    ------
    ValueError
        when more parameters are free than the conditions determine.
    """
    own, unfoldings = len(bvp.parameters), count - (len(free) - (bvp.n_free - 1 + controls))
    if unfoldings < 0:
        raise ValueError(
            f"free: expected {len(free) + unfoldings} names, got {len(free)}: a phase condition determines one more "
            "only where a continuous symmetry moves the state"
        )
    return bvp.unfolded(count, unfoldings), [*free, *range(own, own + unfoldings)]


def fitted(v: Columns, scalars: int) -> Columns:
    """A vector with so many scalars: those of unfolding parameters are cut off, or zero."""
    kept = v.scalars[:scalars]
    return Columns(v.stage, v.mesh, np.append(kept, np.zeros(scalars - len(kept))))


def orbit_directions(colloc: Collocation, x: Columns) -> list[Columns]:
    """Orthonormal basis of the directions in which the continuous symmetries move a state, the strongest first.

    Raises
    ------
    ValueError
        when a symmetry moves a parameter that is not free, or the continuation parameter.
    """
    found = [velocity(colloc, x, i, following=True) for i in range(len(colloc.bvp.generators))]
    if not found:
        return []
    squares, factors = np.linalg.eigh(np.array([[colloc.inner(v, w) for w in found] for v in found]))
    sizes = np.sqrt(np.maximum(squares[::-1], 0.0))
    kept = int((sizes > MOVED * max(1.0, float(sizes[0]))).sum())
    return [_combination(found, factors[:, -1 - i] / sizes[i]) for i in range(kept)]


def moved_by(colloc: Collocation, x: Columns) -> tuple[str, ...]:
    """Names of the continuous symmetries that move a state."""
    sizes = [colloc.norm(velocity(colloc, x, i)) for i in range(len(colloc.bvp.generators))]
    return tuple(g.name for g, size in zip(colloc.bvp.generators, sizes, strict=True) if size > MOVED)


def velocity(colloc: Collocation, x: Columns, number: int, following: bool = False) -> Columns:
    """Velocity of a scaled state under one generator; `following` a branch, it must not change what is held there."""
    generator = colloc.bvp.generators[number]
    own, su = generator.on_parameters.numel_in(0), colloc.scale.unknowns
    p = colloc.parameters(x)[:own]
    at_gauss, at_mesh = colloc.kept(
        f"velocity {number}",
        lambda: tuple(evaluator(generator.velocity, count) for count in (colloc.count, len(colloc.mesh))),
    )
    stage = at_gauss(colloc.gauss, x.stage * su, p)[0].reshape(x.stage.shape) / su
    mesh = at_mesh(colloc.mesh, x.mesh * su, p)[0].reshape(x.mesh.shape) / su
    change = np.zeros(len(colloc.base))
    change[:own] = np.asarray(generator.on_parameters(p)).ravel()
    change /= colloc.scale.parameters
    held = np.setdiff1d(np.arange(len(change)), colloc.free[1:])
    if following and np.abs(change[held]).max(initial=0.0) > MOVED:
        name = colloc.bvp.parameter_names[held[int(np.abs(change[held]).argmax())]]
        raise ValueError(
            f"free: expected '{name}' among the free parameters behind the first, because the symmetry "
            f"'{generator.name}' changes it"
        )
    return Columns(stage, mesh, change[colloc.free])


def phase_at(colloc: Collocation, x: Columns, away: Columns | None = None) -> Phase:
    """Phase conditions with the state x as reference; left vectors from solves with random smooth borders.

    Where x is moved in fewer directions than there are conditions, those of a state `away` from it count or, without
    one, random ones take the place of the others.
    """
    count, rng = colloc.bvp.phases, np.random.default_rng(31)
    at, directions = _moved(colloc, x, away, count)
    while len(directions) < count:
        v = _smooth_vector(colloc, rng)
        v = _combination([v, *directions], np.array([1.0, *(-colloc.inner(u, v) for u in directions)]))
        directions.append(_combination([v], np.array([1.0 / colloc.norm(v)])))
    found: list[tuple[float, Phase]] = []
    for _ in range(ATTEMPTS):
        phase = _referring(colloc, x, directions, [_smooth_column(colloc, rng) for _ in range(colloc.bvp.unfoldings)])
        better, size = _with_left_vectors(colloc, at, phase, None, rng)
        found.append((size, better))
    return min(found, key=lambda pair: pair[0])[1]


def renewed(colloc: Collocation, x: Columns, old: Phase, tangent: Columns, away: Columns | None = None) -> Phase:
    """Phase conditions with x as reference, oriented as the old ones on the same mesh are.

    Where x is not moved any more, as on a trunk that a branch passes, those of a state `away` from it count or, without
    one, the directions stay.
    """
    count, directions = len(old.directions), list(old.directions)
    at, new = _moved(colloc, x, away, count)
    if len(new) == count:
        overlap = np.array([[colloc.inner(v, w) for w in directions] for v in new])
        u, _, vt = np.linalg.svd(overlap)
        turn = u @ vt  # the orthogonal matrix nearest to the overlaps
        directions = [_combination(new, turn[:, i]) for i in range(count)]
    phase = _referring(colloc, x, directions, old.columns)
    return _with_left_vectors(colloc, at, phase, tangent, np.random.default_rng(31))[0]


def _moved(colloc: Collocation, x: Columns, away: Columns | None, count: int) -> tuple[Columns, list[Columns]]:
    """The state, or that away from it, which is moved in enough directions, and these."""
    found = orbit_directions(colloc, x)[:count]
    if len(found) < count and away is not None:
        return away, orbit_directions(colloc, away)[:count]
    return x, found


def _referring(colloc: Collocation, x: Columns, directions: Sequence[Columns], columns: Sequence[Blocks]) -> Phase:
    return Phase(tuple(directions), tuple(colloc.inner(v, x) for v in directions), tuple(columns))


def _with_left_vectors(
    colloc: Collocation, x: Columns, phase: Phase, tangent: Columns | None, rng: np.random.Generator
) -> tuple[Phase, float]:
    """The conditions with better columns, and the size of the left vectors; the old ones where that is infinite.

    K^T w = unit vector of an unfolding parameter, with K bordered by the old columns, makes w^T F' = 0. The last row of
    K is the tangent; on a locus it has one more.
    """
    k, c, bvp = len(colloc.free), len(phase.columns), colloc.bvp
    missing = bvp.size + k - bvp.n_boundary - bvp.n_integral - (tangent is not None)
    border = [colloc.row(v) for v in [tangent] if v is not None]
    border += [colloc.row(_smooth_vector(colloc, rng)) for _ in range(missing)]
    columns, largest = [], 0.0
    with np.errstate(all="ignore"):
        lin = phase.added(colloc, x, colloc.bare_linearization(x))
        fac = colloc.factor(lin, border) if lin.is_finite else None
        for i in range(c if fac is not None and fac.sign != 0.0 else 0):
            unit = np.eye(k)[colloc.unfolding_scalars[i]]
            w = fac.solve_transposed(Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), unit))  # type: ignore[union-attr]
            dense = np.concatenate([w.dense[: bvp.n_integral - bvp.phases], np.zeros(bvp.phases)])
            stage = colloc.step[:, None, None] ** 2 / colloc.quadrature * w.stage
            column = Blocks(stage, np.zeros_like(w.chain), w.ends[: bvp.n_boundary], dense)
            size = _size(colloc, column)
            largest = max(largest, size)
            columns.append(_times(column, 1.0 / size))
    if len(columns) < c or not np.isfinite(largest):
        return phase, np.inf
    return replace(phase, columns=tuple(columns)), largest


def _size(colloc: Collocation, column: Blocks) -> float:
    """Norm of a column as a residual per length."""
    stage = column.stage / colloc.step[:, None, None]
    return float(np.sqrt(np.vdot(colloc.quadrature * stage, stage) + column.ends @ column.ends
                         + column.dense @ column.dense))  # fmt: skip


def _times(b: Blocks, factor: float) -> Blocks:
    return Blocks(b.stage * factor, b.chain * factor, b.ends * factor, b.dense * factor)


def _combination(vectors: Sequence[Columns], factors: np.ndarray) -> Columns:
    pairs = list(zip(vectors, factors.tolist(), strict=True))
    keys = ("stage", "mesh", "scalars")
    return Columns(*(np.sum([f * getattr(v, key) for v, f in pairs], axis=0) for key in keys))


def _smooth_vector(colloc: Collocation, rng: np.random.Generator) -> Columns:
    v = displacement(colloc, rng, len(colloc.free), TERMS)
    v.scalars[colloc.unfolding_scalars] = 0.0
    return v


def _smooth_column(colloc: Collocation, rng: np.random.Generator) -> Blocks:
    column = smooth_load(colloc, rng, TERMS)
    column.dense[colloc.bvp.n_integral - colloc.bvp.phases :] = 0.0
    return _times(column, 1.0 / _size(colloc, column))


def _carried(old: Collocation, new: Collocation, column: Blocks) -> Blocks:
    """A column on another mesh: its value per length, a polynomial on each interval, at the new Gauss points."""
    density = column.stage / old.step[:, None, None]
    left = np.einsum("i,jia->ja", lagrange_basis(old.scheme.nodes, np.zeros(1))[0], density)
    at = Interpolation(old.mesh, old.scheme.points, new.gauss.ravel())
    stage = at(np.vstack([left, left[-1:]]), density).reshape(*new.gauss.shape, -1) * new.step[:, None, None]
    return Blocks(stage, np.zeros((len(new.step), stage.shape[2])), column.ends, column.dense)
