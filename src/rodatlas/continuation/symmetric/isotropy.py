"""What symmetries do to solutions: images, the symmetries a solution or a kernel vector has, symmetric subspaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.continuation.checks import check_distinct, check_has, check_number, check_type
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.phase import moved_by
from rodatlas.continuation.discrete.solution import Interpolation, Solution
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.problem.symmetry import Action

if TYPE_CHECKING:
    from rodatlas.continuation.results.branch import SpecialPoint

AWAY = 0.01  # distance along a ray at which a continuous symmetry is seen to move the branch
LARGEST_GROUP = 96


def action_of(bvp: BVP, symmetry: str) -> Action:
    """A declared symmetry by name, or a product 'a * b' of some: b acts first."""
    factors = [name.strip() for name in symmetry.split("*")]
    for name in factors:
        if name not in bvp.symmetries:
            known = ", ".join(bvp.symmetries) or "the declared ones (there are none)"
            raise ValueError(f"symmetry: expected one of {known}, got '{name}'")
    return reduce(lambda a, b: a @ b, (bvp.symmetries[name] for name in factors))


def image(bvp: BVP, symmetry: str, solution: Solution) -> Solution:
    """The solution that a symmetry makes of this one: parameters and observables change with it.

    Its mesh is reversed when s is. Where the problem has gauges, the image is put in the gauge that satisfies the
    boundary conditions best.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("symmetry", symmetry, str, "the name of a declared symmetry")
    check_type("solution", solution, Solution, "a Solution")
    action = action_of(bvp, symmetry)
    candidates = [_image(g, solution) for g in _with_gauges(bvp, action)]
    if len(candidates) > 1:
        candidates.sort(key=lambda c: _boundary_error(bvp, c))
    found = replace(candidates[0], places=bvp.places(candidates[0].parameters))
    if bvp.observables:
        colloc = _plain(bvp, found, Scale(np.ones(bvp.size), np.ones(len(bvp.parameters))))
        found = replace(found, observables=colloc.observables(colloc.state(found)))
    return found


def isotropy(
    bvp: BVP, solution: Solution, tolerance: float = 1e-5, among: Sequence[str] | None = None
) -> tuple[str, ...]:
    """Names of the symmetries, discrete and continuous, that leave a solution unchanged (up to a gauge).

    Parameters
    ----------
    tolerance : largest distance of a solution from its image in the scaled norm of continuation; on a mesh that is
        not symmetric the image is interpolated.
    among : names or products 'a * b' of discrete symmetries to be tested; all declared symmetries by default.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("solution", solution, Solution, "a Solution")
    check_number("tolerance", tolerance, 0.0, np.inf, "a finite distance")
    names = _among(bvp, among)
    colloc = _plain(bvp, solution, Scale.of(bvp, solution))
    x = colloc.state(solution)
    kept = tuple(name for name in names if _nearest(colloc, name, x)[1] < tolerance)
    return kept if among is not None else kept + _unmoved(colloc, x)


def _among(bvp: BVP, among: Sequence[str] | None) -> tuple[str, ...]:
    """The symmetries that were asked for, all discrete ones by default."""
    if among is None:
        return tuple(bvp.symmetries)
    check_distinct("among", among, "names of symmetries or products 'a * b'")
    return tuple(among)


def _unmoved(colloc: Collocation, x: Columns) -> tuple[str, ...]:
    """Names of the continuous symmetries that leave a state alone."""
    moved = moved_by(colloc, x)
    return tuple(g.name for g in colloc.bvp.generators if g.name not in moved)


def parity(colloc: Collocation, symmetry: str, x: Columns, v: Columns, tolerance: float = 1e-3) -> int:
    """1 when a symmetry of the solution x keeps the vector v, -1 when it changes its sign, 0 for a mixture.

    Parameters
    ----------
    x, v : state and a vector of its tangent space (of a kernel, or along a branch), scaled, on the mesh of `colloc`.
    tolerance : of the comparison, relative to v.

    Raises
    ------
    ValueError
        when the solution does not have the symmetry.
    """
    action, distance = _nearest(colloc, symmetry, x)
    if not distance < tolerance * (1.0 + colloc.norm(x)):
        raise ValueError(f"symmetry: expected one that leaves the solution unchanged, got '{symmetry}'")
    w = acted(colloc, action, v, tangent=True)
    size = tolerance * colloc.norm(v)
    for sign in (1, -1):
        if colloc.norm(add(w, (-float(sign), v))) < size:
            return sign
    return 0


def broken(
    colloc: Collocation, x: Columns, v: Columns, tolerance: float = 1e-5, among: Sequence[str] | None = None
) -> tuple[str, ...]:
    """Names of the symmetries of the solution x that a kernel vector v does not have: a branch along v loses them.

    Parameters
    ----------
    x, v : state and vector, scaled; tolerance, among : as for :func:`isotropy`.
    """
    names = _among(colloc.bvp, among)
    own = [name for name in names if _nearest(colloc, name, x)[1] < tolerance]
    return tuple(name for name in own if parity(colloc, name, x, v) != 1)


def broken_at(bvp: BVP, special: SpecialPoint, among: Sequence[str] | None = None) -> tuple[str, ...]:
    """Names of the symmetries that the other branch through a branch point loses; none where it is not known.

    At a multiple branch point it is the first of the other branches, `special.rays[2]`.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_has("special", special, ("rays", "solution"), "a special point of a branch")
    if len(special.rays) < 3:
        return ()
    found, scale = special.solution, special.scale or Scale.of(bvp, special.solution)
    colloc = Collocation.at(bvp, found, free_indices(bvp, special.free), scale)
    return broken(colloc, colloc.state(found), special.rays[2], among=among)


def with_symmetry(bvp: BVP, special: SpecialPoint) -> SpecialPoint:
    """The special point with the symmetries that its solution has, and those that a branch through it loses."""
    if not (bvp.symmetries or bvp.generators):
        return special
    own = isotropy(bvp, special.solution)
    if not own or special.kind != "branch point" or special.scale is None:
        return replace(special, isotropy=own)
    found = special.solution
    colloc = Collocation.at(bvp, found, free_indices(bvp, special.free), special.scale)
    x = colloc.state(found)
    discrete = [name for name in own if name in bvp.symmetries]
    lost = {name for ray in special.rays[::2] for name in broken(colloc, x, ray, among=discrete)}
    lost |= {name for ray in special.rays for name in moved_by(colloc, add(x, (AWAY, ray)))}
    return replace(special, isotropy=own, breaks=tuple(name for name in own if name in lost))


def acted(colloc: Collocation, action: Action, x: Columns, tangent: bool = False) -> Columns:
    """Image of a scaled state, or of a tangent vector, on the same mesh; the fixed parameters are not looked at."""
    n, su, k = action.size, colloc.scale.unknowns, len(colloc.free)
    p = colloc.parameters(x)
    if tangent:
        p = np.zeros_like(p)
        p[colloc.free] = x.scalars[:k] * colloc.scale.parameters[colloc.free]
    tail = np.append(p, 0.0 if tangent else 1.0)
    stage, mesh = _reversed(colloc, x) if action.reverse else (x.stage, x.mesh)
    linear = (action.matrix[:n, :n] * su / su[:, None]).T
    shift = action.matrix[:n, n:] @ tail / su
    scalars = (action.matrix[n:-1, n:] @ tail / colloc.scale.parameters)[colloc.free]
    return Columns(stage @ linear + shift, mesh @ linear + shift, scalars)


# -- symmetric subspaces ----------------------------------------------------------------------------------------------


def symmetric_mesh(mesh: np.ndarray) -> np.ndarray:
    """The mesh nearest to a given one that is its own mirror image about s = 1/2."""
    if np.abs(mesh + mesh[::-1] - 1.0).max() < 1e-15:
        return mesh
    out = (mesh + 1.0 - mesh[::-1]) / 2
    out[0], out[-1] = 0.0, 1.0
    return out


def is_symmetric_mesh(mesh: np.ndarray) -> bool:
    """Whether a mesh is its own mirror image about s = 1/2, but for round-off."""
    return bool(np.abs(mesh + mesh[::-1] - 1.0).max() < 1e-12)


@dataclass(frozen=True, eq=False)
class Subspace:
    r"""Projection on the states that a group of symmetries leaves unchanged.

    .. math:: P x = \frac{1}{|G|} \sum_{g \in G} g x

    Call it with a tangent vector or Newton correction; :meth:`state` projects a state. It belongs to the units and
    free parameters of a discretisation, not to its mesh, which must be symmetric when some symmetry reverses s.
    Collocation on a symmetric mesh has the symmetries of the problem, so Newton's corrections at a symmetric state are
    symmetric up to round-off, and projecting them takes away only what round-off makes grow near a singular point.

    Attributes
    ----------
    names : of the symmetries.
    reverses : whether one of them reverses s.
    direct, flipped : (n, n) factors of u(s) and u(1-s), scaled.
    by_scalars : (n, k) and shift : (n,), what is added for the free parameters, and for the fixed ones.
    scalars : (k, k) and scalar_shift : (k,), the same for the free parameters.
    """

    names: tuple[str, ...]
    reverses: bool
    direct: np.ndarray
    flipped: np.ndarray
    by_scalars: np.ndarray
    shift: np.ndarray
    scalars: np.ndarray
    scalar_shift: np.ndarray

    def __repr__(self) -> str:
        return f"Subspace({', '.join(self.names)})"

    def __call__(self, v: Columns) -> Columns:
        """Projection of a tangent vector; scalars beyond the free parameters are kept."""
        k = len(self.scalars)
        return self._mapped(v, self.by_scalars @ v.scalars[:k], self.scalars @ v.scalars[:k])

    def state(self, x: Columns) -> Columns:
        """Projection of a state."""
        p = x.scalars[: len(self.scalars)]
        return self._mapped(x, self.by_scalars @ p + self.shift, self.scalars @ p + self.scalar_shift)

    def mesh(self, mesh: np.ndarray) -> np.ndarray:
        """The mesh nearest to a given one on which the projection can be made."""
        return symmetric_mesh(mesh) if self.reverses else mesh

    def _mapped(self, x: Columns, shift: np.ndarray, scalars: np.ndarray) -> Columns:
        stage, mesh = x.stage @ self.direct.T + shift, x.mesh @ self.direct.T + shift
        if self.reverses:
            stage = stage + x.stage[::-1, ::-1] @ self.flipped.T
            mesh = mesh + x.mesh[::-1] @ self.flipped.T
        return Columns(stage, mesh, np.concatenate([scalars, x.scalars[len(scalars) :]]))


def subspace(colloc: Collocation, symmetries: Sequence[str], x: Columns, controls: int = 1) -> Subspace:
    """The subspace of all states with these symmetries (and their products) in which x lies, or nearly so.

    Parameters
    ----------
    controls : number of free parameters that are varied, the first ones: 1 on a branch, 2 on a locus.

    Raises
    ------
    ValueError
        when a symmetry changes such a parameter or a fixed one: it then holds at single points only.
    """
    n, free = colloc.bvp.size, colloc.free
    generators = [_nearest(colloc, name, x)[0] for name in symmetries]
    group = generated(generators, len(colloc.bvp.parameters) + n + 1)
    direct, flipped = (
        sum((g.matrix for g in group if g.reverse is flag), np.zeros_like(group[0].matrix)) / len(group)
        for flag in (False, True)
    )
    both = direct + flipped
    fixed = np.setdiff1d(np.arange(len(colloc.base)), free)
    base = np.append(colloc.base, 1.0)
    base[free] = 0.0
    moved = both[n:-1, n:] @ np.append(colloc.parameters(x), 1.0) - colloc.parameters(x)
    for i in (*fixed, *free[:controls]):
        among_free = both[n + i, n + free] - (free == i)
        if abs(moved[i]) > 1e-9 * max(1.0, abs(colloc.base[i])) or np.abs(among_free).max() > 1e-9:
            raise ValueError(
                f"within: expected symmetries that keep the parameter '{colloc.bvp.parameter_names[i]}', "
                f"got {', '.join(symmetries)}"
            )
    su, sp = colloc.scale.unknowns, colloc.scale.parameters[free]
    return Subspace(
        tuple(symmetries), any(g.reverse for g in group), direct[:n, :n] * su / su[:, None],
        flipped[:n, :n] * su / su[:, None], both[:n, n + free] * sp / su[:, None], both[:n, n:] @ base / su,
        both[np.ix_(n + free, n + free)] * sp / sp[:, None], (both[n + free, n:] @ base) / sp,
    )  # fmt: skip


def projected(colloc: Collocation, symmetries: Sequence[str] | str, x: Columns, controls: int = 1) -> Columns:
    """The state made symmetric: the mean of its images; the mesh must be symmetric when s is reversed."""
    names = (symmetries,) if isinstance(symmetries, str) else tuple(symmetries)
    space = subspace(colloc, names, x, controls)
    if space.reverses and not is_symmetric_mesh(colloc.mesh):
        raise ValueError("mesh: expected one that is symmetric about 1/2, see symmetric_mesh()")
    return space.state(x)


def restrict(colloc: Collocation, symmetries: Sequence[str], x: Columns, controls: int = 1) -> Columns:
    """Confine Newton's method on a discretisation to a symmetric subspace; returns the state made symmetric."""
    if not symmetries:
        return x
    x = projected(colloc, symmetries, x, controls)
    colloc.within = subspace(colloc, symmetries, x, controls)
    return x


def generated(generators: Sequence[Action], size: int) -> list[Action]:
    """All elements of the group that some actions generate, the identity first.

    Raises
    ------
    ValueError
        when there are too many.
    """
    group = [Action("identity", np.eye(size), generators[0].size if generators else 0)]
    for element in group:  # grows while it is walked over
        for g in generators:
            new = g @ element
            if not any(new.reverse == e.reverse and np.abs(new.matrix - e.matrix).max() < 1e-9 for e in group):
                group.append(new)
        if len(group) > LARGEST_GROUP:
            raise ValueError(f"symmetries: expected a group of at most {LARGEST_GROUP} elements")
    return group


# -- helpers ----------------------------------------------------------------------------------------------------------


def _with_gauges(bvp: BVP, action: Action) -> list[Action]:
    return [action, *(g @ action for g in bvp.gauges)]


def _nearest(colloc: Collocation, symmetry: str, x: Columns) -> tuple[Action, float]:
    """The symmetry in the gauge whose image of x is nearest to x, and the distance (fixed parameters included)."""
    action = action_of(colloc.bvp, symmetry)
    p = colloc.parameters(x)
    moved = (action.parameters(p) - p) / colloc.scale.parameters
    moved[colloc.free] = 0.0
    fixed = float(np.linalg.norm(moved))
    found = [(g, colloc.norm(add(acted(colloc, g, x), (-1.0, x)))) for g in _with_gauges(colloc.bvp, action)]
    best, distance = min(found, key=lambda pair: pair[1])
    return best, float(np.hypot(distance, fixed))


def _reversed(colloc: Collocation, x: Columns) -> tuple[np.ndarray, np.ndarray]:
    """Stages and mesh values of x(1 - s)."""
    if is_symmetric_mesh(colloc.mesh):
        return x.stage[::-1, ::-1], x.mesh[::-1]
    s = 1.0 - np.concatenate([colloc.gauss.ravel(), colloc.mesh])
    values = Interpolation(colloc.mesh, colloc.scheme.points, s)(x.mesh, x.stage)
    return values[: colloc.gauss.size].reshape(x.stage.shape), values[colloc.gauss.size :]


def _image(action: Action, solution: Solution) -> Solution:
    mesh, values, stages = solution.mesh, solution.values, solution.stages
    if action.reverse:
        mesh, values, stages = 1.0 - mesh[::-1], values[::-1], stages[::-1, ::-1]
    p = solution.parameters
    return replace(
        solution, mesh=mesh, values=action.unknowns(values, p), stages=action.unknowns(stages, p),
        parameters=action.parameters(p) + 0.0,
    )  # fmt: skip


def _boundary_error(bvp: BVP, solution: Solution) -> float:
    ends = np.concatenate([solution.values[0], solution.values[-1]])
    p = bvp.coordinates(solution.parameters)
    return float(np.abs(np.asarray(bvp.traced.ends(ends, p)[0])[: bvp.n_boundary]).max())


def _plain(bvp: BVP, solution: Solution, scale: Scale) -> Collocation:
    """A discretisation on the solution's own mesh in which every parameter is part of the state."""
    return Collocation.at(bvp, solution, range(len(bvp.parameters)), scale)
