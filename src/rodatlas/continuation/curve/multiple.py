r"""Multiple branch points: places of a branch where the kernel of F' has a dimension of three or more.

Along the branch they are zeros of det G, with G the block that :mod:`rodatlas.continuation.singular.kernel` defines;
zeros that lie together are tried as one point, where all of G vanishes. All branches through such a point come from
:mod:`rodatlas.continuation.singular.rays`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.segment import Segment
from rodatlas.continuation.discrete.collocation import Collocation, Row
from rodatlas.continuation.discrete.newton import NewtonOptions, newton, plane
from rodatlas.continuation.discrete.random_fields import smooth_vectors
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.linear.matrix import Blocks, Columns
from rodatlas.continuation.singular.bordered import BorderedSystem, combined_left, left_column
from rodatlas.continuation.singular.kernel import (
    Kernel,
    combined,
    resolved,
)
from rodatlas.continuation.singular.rays import Rays
from rodatlas.continuation.singular.smallest import orthonormal

WATCHED = 4  # modes followed along a segment; more are taken when all of them become singular together
SHORTEST = 1e-3  # arclength on which G is interpolated at least: points much closer to a singular one lose accuracy
CLOSE = 0.1  # share of a step; a state so close to a multiple point is hard to tell from it
TOGETHER = 1e-4  # arclength within which zeros are first tried as one multiple point


@dataclass(frozen=True, eq=False)
class MultiplePoint:
    """A branch point with a kernel of dimension d + 1, d >= 2.

    Attributes
    ----------
    kernel : Kernel, with the discretisation and the state.
    multiplicity : d.
    residual : how far G is from zero, as the distance in state space (scaled) over which it would vanish.
    fraction, arclength : place on the segment and along the branch.
    error : estimated error at mesh points and in the parameters.
    directions : unit tangents of all rays that leave the point; the branch walked comes first, forward and then
        backward, and each smooth curve appears twice, once for each side. See :class:`Rays`.
    nearby : a state on each of the rays, at about the distance `radius` from the point.
    radius : of the sphere on which the rays were sought; four times that at most.
    continuum : whether a continuous family of branches leaves the point, of which `directions` holds one each.
    unverified : candidates of rays that could not be confirmed; 0 when the list is complete.
    """

    kernel: Kernel
    multiplicity: int
    residual: float
    fraction: float
    arclength: float
    error: float = float("nan")
    directions: tuple[Columns, ...] = field(default=(), repr=False)
    nearby: tuple[Columns, ...] = field(default=(), repr=False)
    radius: float = float("nan")
    continuum: bool = False
    unverified: int = 0

    @property
    def colloc(self) -> Collocation:
        return self.kernel.colloc

    @property
    def state(self) -> Columns:
        return self.kernel.state

    def __repr__(self) -> str:
        family = ", a continuum" if self.continuum else ""
        name = self.colloc.bvp.parameter_names[self.colloc.free[0]]
        value = self.colloc.bvp.values(self.colloc.parameters(self.state))[self.colloc.free[0]]
        rays = f"{len(self.directions)} rays{family}"
        return f"MultiplePoint({name} = {value:.10g}, multiplicity {self.multiplicity}, {rays})"


@dataclass(frozen=True, eq=False)
class SingularPlace:
    """A place of a segment where the bordered matrix is singular; `point` is None when it is so only once.

    `state` is good enough to start Newton for the augmented system of a simple branch point.
    """

    fraction: float
    arclength: float
    state: Columns
    point: MultiplePoint | None = None

    @property
    def multiplicity(self) -> int:
        return self.point.multiplicity if self.point else 1


@dataclass(frozen=True)
class Search:
    """Singular places of a segment.

    Attributes
    ----------
    places : in order.
    complete : whether there are no others; it is False when the branch could not be followed well enough to tell.
    close : whether several modes become singular close to the right end of the segment, on either side of it.
    """

    places: tuple[SingularPlace, ...]
    complete: bool = True
    close: bool = False


def search_places(segment: Segment, options: TraceOptions, keep_off: bool = False) -> Search:
    """All places on a segment where a mode becomes singular; those of multiplicity two or more with all branches.

    Places at the very ends of the segment are included. A mode that touches zero without crossing it counts once. With
    `keep_off` there are none where the segment should end somewhere else.
    """
    count, slack = WATCHED, max(1e-6, 1e-8 / segment.step)
    reach = max(0.5, SHORTEST / 2 / segment.step)
    while True:
        border = _watched(segment, count)
        zeros = border and _zeros(segment, border, segment.interpolate, (0.5 - reach, 0.5 + reach), options.newton, 0)
        if border is None or zeros is None:
            return Search((), False)
        zeros = sorted(zeros, key=lambda z: z[0])
        close = any(len(g) > 1 and abs(g[0] - 1) < CLOSE for g in _grouped([t for t, _ in zeros], 0.1 * CLOSE))
        if close and keep_off:
            return Search((), False, True)
        found = [z for z in zeros if -slack <= z[0] <= 1 + slack]
        groups = _grouped([t for t, _ in found], TOGETHER / segment.step)
        if max(map(len, groups), default=0) < count or count > 16:
            break
        count *= 2
    places: list[SingularPlace] = []
    for group in groups:
        here, found = found[: len(group)], found[len(group) :]
        point, single = _multiple(segment, border, here, options) if len(group) > 1 else (None, False)
        states = [point.state] if point else [x for _, x in (here[:1] if single else here)]
        for x in states:
            t = point.fraction if point else segment.position(x)[0]
            places.append(SingularPlace(t, segment.start + t * segment.step, x, point))
    return Search(tuple(places), True, close)


def _multiple(
    segment: Segment, border: tuple[list[Row], list[Blocks]], zeros: list[tuple[float, Columns]], options: TraceOptions
) -> tuple[MultiplePoint | None, bool]:
    """The multiple point at zeros of det G that lie together, and its branches; None when it is not one.

    The second value tells whether they are zeros of one mode, at a simple branch point.
    """
    colloc, count, (fraction, x) = segment.colloc, len(zeros), zeros[len(zeros) // 2]
    b = BorderedSystem(colloc, colloc.linearize(x), *border)
    if b.is_singular:
        return None, False
    weakest, g = b.kernel()
    u, sizes, vt = np.linalg.svd(g[:, 1:])
    count = min(count, int((sizes < 1e-2 * sizes[0]).sum()))
    if count < 2:
        return None, count == 1
    lefts = b.left_vectors()
    columns = [left_column(colloc, combined_left(lefts, u[:, -1 - i])) for i in range(count)]
    tangent = segment.direction(fraction)
    vectors = [combined(weakest[1:], vt[-1 - i]) for i in range(count)]
    kernel = Kernel(colloc, x, (tangent, *orthonormal(colloc, vectors, [tangent])), tuple(columns))
    found, error = resolved(kernel, options.mesh)
    if not found.converged or found.residual > 1e-9 + options.mesh.tolerance:
        return None, False
    kernel = found.kernel
    back = kernel.state if kernel.colloc is colloc else kernel.colloc.interpolate(kernel.state, colloc)
    place, off = segment.position(back)
    if off > 0.1:
        return None, False
    rays = Rays.of(kernel)
    point = MultiplePoint(
        kernel, count, found.residual, place, segment.start + place * segment.step, error, rays.directions, rays.nearby,
        rays.radius, rays.continuum, rays.unverified,
    )  # fmt: skip
    return point, False


def _watched(segment: Segment, count: int) -> tuple[list[Row], list[Blocks]] | None:
    """Rows (tangent, weakest directions) and columns that follow the `count` smallest singular values on a segment.

    Block inverse iteration in the mesh-independent norms of
    :func:`rodatlas.continuation.singular.smallest.smallest_singular`.
    """
    colloc, tangent = segment.colloc, segment.direction(0.5)
    row = colloc.row(tangent)
    for x in (segment.left.x, segment.right.x, segment.interpolate(0.4)):
        fac = colloc.factor(colloc.linearize(x), [row])
        if fac.sign != 0.0:
            break
    else:
        return None
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    block = smooth_vectors(colloc, np.random.default_rng(13), count, count + 1, len(colloc.free))
    lefts: list[Blocks] = []
    for _ in range(4):
        block = orthonormal(colloc, block)
        weights = [colloc.row(v) for v in block]
        lefts = [fac.solve_transposed(Columns(w.stage, np.zeros_like(x.mesh), w.scalars))  # type: ignore[arg-type]
                 for w in weights]  # fmt: skip
        block = [fac.solve(Blocks(per_length * w.stage, np.zeros_like(w.chain), w.ends, w.dense)) for w in lefts]
        if not all(np.isfinite(colloc.norm(v)) for v in block):
            return None
    block = orthonormal(colloc, block, [tangent])
    columns: list[Blocks] = []
    for w in lefts:  # independent columns: the left vectors of very different size would be nearly parallel
        column = left_column(colloc, w)
        for _ in range(2):
            column = left_column(colloc, combined_left([column, *columns], _across(column, columns)))
        columns.append(column)
    return [row, *map(colloc.row, block)], columns


def _across(v: Blocks, others: Sequence[Blocks]) -> np.ndarray:
    """Factors that remove from v its share along orthonormal left vectors."""
    share = [sum(float(np.vdot(getattr(v, p), getattr(u, p))) for p in ("stage", "ends", "dense")) for u in others]
    return np.array([1.0, *(-s for s in share)])


Curve = Callable[[float], Columns]


def _on_branch(segment: Segment, fraction: float, guess: Columns, off: float, options: NewtonOptions) -> Columns | None:
    """The branch at a fraction of the segment; None where Newton fails or goes further than `off` from the guess."""
    result = newton(segment.colloc, guess, [plane(segment.colloc, segment.direction(fraction), guess)], options)
    missed = segment.colloc.norm(add(result.state, (-1.0, guess)))
    return result.state if result.converged and missed < off else None


def _through(places: np.ndarray, states: list[Columns]) -> Curve:
    """The polynomial curve through states."""

    def curve(t: float) -> Columns:
        off = places[:, None] - places[None, :] + np.eye(len(places))
        weights = [float(np.prod((t - np.delete(places, i)) / np.delete(off[i], i))) for i in range(len(places))]
        return combined(states, np.array(weights))

    return curve


def _zeros(
    segment: Segment, border: tuple[list[Row], list[Blocks]], curve: Curve, limits: tuple[float, float],
    options: NewtonOptions, depth: int,
) -> list[tuple[float, Columns]] | None:  # fmt: skip
    """Zeros of det G along the branch, with multiplicity: eigenvalues of the matrix polynomial that interpolates G.

    Each group of zeros is sought again on an interval twenty times shorter, down to about SHORTEST, where points are
    still far enough from the singular ones to be computed to round-off. `curve` approximates the branch. None when
    too few of its points can be computed.
    """
    middle, half = sum(limits) / 2, (limits[1] - limits[0]) / 2
    places, samples, states = [], [], []
    for t in middle + half * np.cos(np.pi * (2 * np.arange(6) + 1) / 12):
        x = _on_branch(segment, t, curve(t), 0.1 * half * segment.step, options)
        b = BorderedSystem(segment.colloc, segment.colloc.linearize(x), *border) if x is not None else None
        if x is None or b is None or b.is_singular:
            continue
        g = b.kernel()[1]
        if np.isfinite(g).all():
            places.append(float(t))
            samples.append(g[:, 1:])
            states.append(x)
    if len(samples) < 3:
        return None
    tau = _eigenvalues((np.array(places) - middle) / half, np.array(samples))
    size, last = half * segment.step, depth == 2 or half * segment.step < SHORTEST
    near = (np.abs(tau.imag) < (1e-5 / size if last else 0.1)) & (np.abs(tau.real) < 1.1)
    found, through = np.sort(tau.real[near]), _through(np.array(places), states)
    if depth == 0 and not len(found):  # one point less should not make zeros appear
        fewer = _eigenvalues(np.delete((np.array(places) - middle) / half, 2), np.delete(samples, 2, axis=0))
        return None if ((np.abs(fewer.imag) < 0.1) & (np.abs(fewer.real) < 1.1)).any() else []
    if last:
        return [(t, through(t)) for t in (middle + half * found).tolist()]
    margin = max(0.05, 3e-4 / size)
    groups = [(middle + half * (g[0] - margin), middle + half * (g[-1] + margin))
              for g in _grouped(found.tolist(), 3 * margin)]  # fmt: skip
    zeros = [_zeros(segment, border, through, g, options, depth + 1) for g in groups]
    return None if None in zeros else [z for part in zeros if part for z in part]


def _eigenvalues(places: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Where the polynomial through the matrices `samples` (m, K, K) at `places` (m,) is singular: a linear pencil."""
    from scipy.linalg import eigvals

    m, k = samples.shape[:2]
    coefficients = np.linalg.solve(np.vander(places, increasing=True), samples.reshape(m, -1)).reshape(samples.shape)
    left, right = np.eye((m - 1) * k, k=k), np.eye((m - 1) * k)
    left[-k:] = -np.concatenate(coefficients[:-1], axis=1)
    right[-k:, -k:] = coefficients[-1]
    with np.errstate(all="ignore"):
        values = eigvals(left, right)
    return values[np.isfinite(values)]


def _grouped(values: list[float], gap: float) -> list[list[float]]:
    """Sorted values split where neighbours are more than `gap` apart."""
    groups: list[list[float]] = []
    for v in values:
        if groups and v - groups[-1][-1] <= gap:
            groups[-1].append(v)
        else:
            groups.append([v])
    return groups
