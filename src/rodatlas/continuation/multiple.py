r"""Multiple branch points: places where the kernel of F' has a dimension of three or more, and all branches there.

With F' of n rows and n + 1 columns, d + 1 rows C and d columns B, the solution of

.. math:: \begin{pmatrix} F' & B \\ C & 0 \end{pmatrix} \begin{pmatrix} V \\ G \end{pmatrix} =
          \begin{pmatrix} 0 \\ I_{d+1} \end{pmatrix}

has a d x (d + 1) block G that vanishes as a whole exactly where the kernel of F' has dimension d + 1: a branch point of
multiplicity d. Where only det G vanishes along a branch, the branch point is simple. (Govaerts 2000, chapter 3 and 4.)

All branches through the point are zeros of the reduced map g on the kernel (Lyapunov-Schmidt): for a in R^(d+1) solve
:math:`F(x_0 + \Phi a + w) + B g = 0,\ C w = 0`; its derivative is G. On small spheres |a| = r the zeros of g are
isolated points, one for each ray of a branch, or curves where a continuous symmetry moves the branches around.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations_with_replacement

import numpy as np

from rodatlas.continuation.augmented import left_column
from rodatlas.continuation.collocation import Collocation, Row, add, scaled
from rodatlas.continuation.events import Segment
from rodatlas.continuation.linear import Blocks, Columns, Factorization
from rodatlas.continuation.mesh import MeshControl, halved, relative_change
from rodatlas.continuation.newton import NewtonOptions, newton, plane
from rodatlas.continuation.options import TraceOptions

WATCHED = 4  # modes followed along a segment; more are taken when all of them become singular together
SHORTEST = 1e-3  # arclength on which G is interpolated at least: points much closer to a singular one lose accuracy
TOGETHER = 1e-4  # arclength within which zeros are first tried as one multiple point


@dataclass(frozen=True, eq=False)
class Kernel:
    """State x at which F' is singular d times, with what borders it.

    vectors : d + 1 orthonormal vectors that span the kernel, the first one near the tangent of the branch walked;
    columns : d left vectors, the columns B.
    """

    colloc: Collocation
    state: Columns
    vectors: tuple[Columns, ...]
    columns: tuple[Blocks, ...]

    @property
    def rows(self) -> list[Row]:
        return [self.colloc.row(v) for v in self.vectors]

    def moved(self, a: np.ndarray) -> Columns:
        """x + sum of a_j v_j."""
        return add(self.state, *zip(a.tolist(), self.vectors, strict=True))

    def coordinates(self, x: Columns) -> np.ndarray:
        """Kernel coordinates a (d + 1,) of a state."""
        dx = add(x, (-1.0, self.state))
        return np.array([self.colloc.inner(v, dx) for v in self.vectors])


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
        value = self.colloc.parameters(self.state)[self.colloc.free[0]]
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


def locate_multiple(segment: Segment, options: TraceOptions) -> MultiplePoint | None:
    """The first multiple branch point on a short segment, with its branches; None when there is none."""
    return next((place.point for place in singular_places(segment, options) if place.point), None)


def singular_places(segment: Segment, options: TraceOptions) -> tuple[SingularPlace, ...]:
    """All places on a segment where a mode becomes singular, in order; those of multiplicity two or more complete.

    Places at the very ends of the segment are included. A mode that touches zero without crossing it counts once.
    """
    count, slack = WATCHED, max(1e-6, 1e-8 / segment.step)
    reach = max(0.5, SHORTEST / 2 / segment.step)
    while True:
        border = _watched(segment, count)
        if border is None:
            return ()
        found = _zeros(segment, border, segment.interpolate, (0.5 - reach, 0.5 + reach), options.newton, 0)
        found = sorted((z for z in found if -slack <= z[0] <= 1 + slack), key=lambda z: z[0])
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
    return tuple(places)


def side_directions(colloc: Collocation, point: MultiplePoint) -> tuple[Columns, ...]:
    """Unit tangents of all rays that leave a multiple point, on the mesh of `colloc`."""
    directions = point.directions or Rays.of(point.kernel).directions
    same = np.array_equal(colloc.mesh, point.colloc.mesh) and colloc.scheme.points == point.colloc.scheme.points
    return directions if same else tuple(map(point.colloc.carrier(colloc), directions))


# -- where: zeros of G along the branch -------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Solved:
    """One factored bordered matrix, with V and G (number of columns, number of rows) of the module's equation."""

    fac: Factorization
    vectors: list[Columns]
    g: np.ndarray


def _solved(
    colloc: Collocation, x: Columns, rows: list[Row], columns: Sequence[Blocks], fac: Factorization | None = None
) -> _Solved | None:
    """V and G of the module's equation at x; None when the matrix is singular."""
    k = len(colloc.free)
    fac = fac or colloc.factor(colloc.linearize(x), rows, columns)
    if fac.sign == 0.0:
        return None
    solutions = [fac.solve(colloc.right_hand_side(None, rows, list(e))) for e in np.eye(len(rows))]
    vectors = [Columns(v.stage, v.mesh, v.scalars[:k]) for v in solutions]
    return _Solved(fac, vectors, np.array([v.scalars[k:] for v in solutions]).T)


def _left(colloc: Collocation, fac: Factorization, x: Columns, count: int) -> list[Blocks]:
    """Left vectors that belong to the artificial unknowns."""
    units = np.eye(len(colloc.free) + count)[len(colloc.free) :]
    return [fac.solve_transposed(Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), e)) for e in units]


def _combined(vectors: Sequence[Columns], factors: np.ndarray) -> Columns:
    return add(scaled(vectors[0], float(factors[0])), *zip(factors[1:].tolist(), vectors[1:], strict=True))


def _combined_left(vectors: Sequence[Blocks], factors: np.ndarray) -> Blocks:
    parts = [[getattr(v, name) * f for v, f in zip(vectors, factors, strict=True)] for name in
             ("stage", "chain", "ends", "dense")]  # fmt: skip
    return Blocks(*(np.sum(part, axis=0) for part in parts))


def _orthonormal(colloc: Collocation, vectors: Sequence[Columns], first: Sequence[Columns] = ()) -> list[Columns]:
    """Gram-Schmidt (twice) after the orthonormal vectors `first`, which are left out of the result."""
    out = list(first)
    for v in vectors:
        for _ in range(2):
            v = add(v, *((-colloc.inner(v, u), u) for u in out))
            v = scaled(v, 1.0 / colloc.norm(v))
        out.append(v)
    return out[len(first) :]


def _watched(segment: Segment, count: int) -> tuple[list[Row], list[Blocks]] | None:
    """Rows (tangent, weakest directions) and columns that follow the `count` smallest singular values on a segment.

    Block inverse iteration in the mesh-independent norms of :func:`rodatlas.continuation.frame.smallest_singular`.
    """
    colloc, tangent = segment.colloc, segment.direction(0.5)
    row = colloc.row(tangent)
    for x in (segment.left.x, segment.right.x, segment.interpolate(0.4)):
        fac = colloc.factor(colloc.linearize(x), [row])
        if fac.sign != 0.0:
            break
    else:
        return None
    rng, n = np.random.default_rng(13), x.stage.shape[2]
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    waves = np.stack([np.cos(j * np.pi * colloc.gauss) for j in range(count + 1)])
    stages = np.einsum("wji,cwa->cjia", waves, rng.normal(size=(count, count + 1, n)))
    block = [Columns(s, np.zeros_like(x.mesh), rng.normal(size=len(colloc.free))) for s in stages]
    lefts: list[Blocks] = []
    for _ in range(4):
        block = _orthonormal(colloc, block)
        weights = [colloc.row(v) for v in block]
        lefts = [fac.solve_transposed(Columns(w.stage, np.zeros_like(x.mesh), w.scalars))  # type: ignore[arg-type]
                 for w in weights]  # fmt: skip
        block = [fac.solve(Blocks(per_length * w.stage, np.zeros_like(w.chain), w.ends, w.dense)) for w in lefts]
        if not all(np.isfinite(colloc.norm(v)) for v in block):
            return None
    block = _orthonormal(colloc, block, [tangent])
    columns: list[Blocks] = []
    for w in lefts:  # independent columns: the left vectors of very different size would be nearly parallel
        column = left_column(colloc, w)
        for _ in range(2):
            column = left_column(colloc, _combined_left([column, *columns], _across(column, columns)))
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
        return _combined(states, np.array(weights))

    return curve


def _zeros(
    segment: Segment, border: tuple[list[Row], list[Blocks]], curve: Curve, limits: tuple[float, float],
    options: NewtonOptions, depth: int,
) -> list[tuple[float, Columns]]:  # fmt: skip
    """Zeros of det G along the branch, with multiplicity: eigenvalues of the matrix polynomial that interpolates G.

    Each group of zeros is sought again on an interval twenty times shorter, down to about SHORTEST, where points are
    still far enough from the singular ones to be computed to round-off. `curve` approximates the branch.
    """
    middle, half = sum(limits) / 2, (limits[1] - limits[0]) / 2
    places, samples, states = [], [], []
    for t in middle + half * np.cos(np.pi * (2 * np.arange(6) + 1) / 12):
        x = _on_branch(segment, t, curve(t), 0.1 * half * segment.step, options)
        at = _solved(segment.colloc, x, *border) if x is not None else None
        if x is not None and at is not None and np.isfinite(at.g).all():
            places.append(float(t))
            samples.append(at.g[:, 1:])
            states.append(x)
    if len(samples) < 3:
        return []
    tau = _eigenvalues((np.array(places) - middle) / half, np.array(samples))
    size, last = half * segment.step, depth == 2 or half * segment.step < SHORTEST
    near = (np.abs(tau.imag) < (1e-5 / size if last else 0.1)) & (np.abs(tau.real) < 1.1)
    found, through = np.sort(tau.real[near]), _through(np.array(places), states)
    if last:
        return [(t, through(t)) for t in (middle + half * found).tolist()]
    margin = max(0.05, 3e-4 / size)
    groups = [(middle + half * (g[0] - margin), middle + half * (g[-1] + margin))
              for g in _grouped(found.tolist(), 3 * margin)]  # fmt: skip
    return [z for g in groups for z in _zeros(segment, border, through, g, options, depth + 1)]


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


# -- the point itself: all of G vanishes ------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Polished:
    """Outcome of Gauss-Newton for G = 0: the kernel, whether it converged, the distance to G = 0, last correction."""

    kernel: Kernel
    converged: bool
    residual: float
    correction: Columns | None


def _multiple(
    segment: Segment, border: tuple[list[Row], list[Blocks]], zeros: list[tuple[float, Columns]], options: TraceOptions
) -> tuple[MultiplePoint | None, bool]:
    """The multiple point at zeros of det G that lie together, and its branches; None when it is not one.

    The second value tells whether they are zeros of one mode, at a simple branch point.
    """
    colloc, count, (fraction, x) = segment.colloc, len(zeros), zeros[len(zeros) // 2]
    at = _solved(colloc, x, *border)
    if at is None:
        return None, False
    u, sizes, vt = np.linalg.svd(at.g[:, 1:])
    count = min(count, int((sizes < 1e-2 * sizes[0]).sum()))
    if count < 2:
        return None, count == 1
    lefts = _left(colloc, at.fac, x, len(border[1]))
    columns = [left_column(colloc, _combined_left(lefts, u[:, -1 - i])) for i in range(count)]
    tangent = segment.direction(fraction)
    vectors = [_combined(at.vectors[1:], vt[-1 - i]) for i in range(count)]
    kernel = Kernel(colloc, x, (tangent, *_orthonormal(colloc, vectors, [tangent])), tuple(columns))
    found, error = _resolved(kernel, options.mesh)
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


def _polished(kernel: Kernel, tolerance: float = 1e-9, max_iterations: int = 10) -> _Polished:
    r"""Gauss-Newton for F(x) + B beta = 0, G(x) = 0.

    Newton's corrections of the first equation leave d + 1 coordinates of the kernel free; they are chosen so that the
    linearised d (d + 1) entries of G vanish in the sense of least squares. The derivative of an entry is
    :math:`\delta G_{ij} = -w_i\cdot F''[v_j, \delta x]`.
    """
    colloc, x, rows, columns = kernel.colloc, kernel.state, kernel.rows, kernel.columns
    d, k = len(columns), len(colloc.free)
    beta, before, residual, dx = np.zeros(d), np.inf, np.inf, None
    at, lefts, converged = None, [], False
    for _ in range(max_iterations):
        lin = colloc.linearize(x)
        fac = colloc.factor(lin, rows, columns)
        at = _solved(colloc, x, rows, columns, fac)
        if at is None:
            break
        lefts = _left(colloc, fac, x, d)
        loaded = _loaded(lin.residual, beta, columns)
        y = fac.solve(colloc.right_hand_side(loaded, rows, [0.0] * len(rows)))
        bare = Columns(y.stage, y.mesh, y.scalars[:k])
        gradients = [scaled(colloc.second(x, v, w), -1.0) for w in lefts for v in at.vectors]
        slopes = np.array([[p.dot(v) for v in at.vectors] for p in gradients])
        values = at.g.reshape(-1) + [p.dot(bare) for p in gradients]
        if not (np.isfinite(slopes).all() and np.isfinite(values).all()):
            break
        alpha = np.linalg.lstsq(slopes, -values, rcond=1e-8)[0]
        dx = add(bare, *zip(alpha.tolist(), at.vectors, strict=True))
        x, beta = add(x, (1.0, dx)), beta + y.scalars[k:] + at.g @ alpha
        steepness = float(np.linalg.svd(slopes, compute_uv=False)[-1])
        missed = float(np.linalg.norm(values + slopes @ alpha) + np.linalg.norm(beta))
        size, residual = colloc.norm(dx), missed / max(steepness, 1e-8)
        converged = size < tolerance or (size < 1e3 * tolerance and size > 0.5 * before)
        if converged or size > 1.0:
            break
        before = size
    if at is None or not converged:
        return _Polished(replace(kernel, state=x), False, residual, dx)
    vectors = _orthonormal(colloc, at.vectors)
    left = tuple(left_column(colloc, w) for w in lefts)
    return _Polished(Kernel(colloc, x, tuple(vectors), left), True, residual, dx)


def _loaded(residual: Blocks, beta: np.ndarray, columns: Sequence[Blocks]) -> Blocks:
    """F + B beta."""
    load = _combined_left(columns, beta)
    return Blocks(
        residual.stage + load.stage, residual.chain, residual.ends + load.ends, residual.dense + load.dense
    )  # fmt: skip


def _resolved(kernel: Kernel, control: MeshControl) -> tuple[_Polished, float]:
    """The polished point on a mesh halved until it is known to the tolerance, and the estimated error.

    As in :func:`rodatlas.continuation.refine.refined`; the mesh of the branch need not resolve the modes, and its
    error separates modes that belong together.
    """
    found, error = _polished(kernel), float("nan")
    while not control.is_fixed_size and 2 * (len(kernel.colloc.step)) <= control.intervals[1]:
        fine = _polished(_halved(found.kernel))
        if not fine.converged:
            break
        old, new = found.kernel, fine.kernel
        dx = add(new.state, (-1.0, old.colloc.interpolate(old.state, new.colloc)))
        change = relative_change(old.colloc, old.state, Columns(dx.stage, dx.mesh[::2], dx.scalars))
        error = change if found.converged else float("nan")
        settled = found.residual <= control.tolerance or fine.residual > 0.5 * found.residual
        if found.converged and error <= control.tolerance and settled:
            break
        found, kernel = fine, new
    return found, error


def _halved(kernel: Kernel) -> Kernel:
    """The kernel on a mesh of halved intervals; columns are carried as their means over each interval."""
    old = kernel.colloc
    fine = Collocation(
        old.bvp, halved(old.mesh), old.scheme.points, old.base, list(old.free), old.scale, old.backend
    )  # fmt: skip
    carry = old.carrier(fine)

    def column(b: Blocks) -> Blocks:
        mean = np.repeat(b.stage.mean(axis=1), 2, axis=0)[:, None, :]
        return Blocks(
            np.repeat(mean, fine.scheme.points, axis=1), np.zeros((len(fine.step), mean.shape[2])), b.ends, b.dense
        )  # fmt: skip

    vectors = _orthonormal(fine, [carry(v) for v in kernel.vectors])
    return Kernel(fine, carry(kernel.state), tuple(vectors), tuple(column(b) for b in kernel.columns))


# -- which branches: zeros of the reduced map on small spheres ---------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays that leave a multiple point; see :class:`MultiplePoint` for the attributes."""

    directions: tuple[Columns, ...]
    nearby: tuple[Columns, ...]
    radius: float
    continuum: bool
    unverified: int

    @classmethod
    def of(cls, kernel: Kernel) -> Rays:
        """All rays: the reduced map is sampled and fitted by a polynomial, whose zeros on a sphere of an eighth of its
        radius are sought from many starts; each is then confirmed with the equations themselves.

        An isolated zero has to persist on spheres of half and a quarter of the radius and its direction to converge;
        the direction is extrapolated to radius zero. Of a curve of zeros one point is kept.
        """
        model = _model(kernel)
        if model is None:
            return cls((), (), float("nan"), False, 1)
        radius, ratio = model.radius / 8, 1.0 / 8
        rays: list[tuple[np.ndarray, Columns]] = []
        unverified, continuum = 0, False
        for u, may_move in zip(*_sphere_zeros(model, ratio), strict=True):
            family = _family(kernel, radius * u) if may_move else None
            continuum |= family is not None
            ray = family or _confirmed(kernel, model, u, ratio)
            if ray is None:
                unverified += 1
            elif not any(kernel.colloc.norm(add(ray[1], (-1.0, x))) < 1e-5 * radius for _, x in rays):
                rays.append(ray)
        ahead = max((u[0] for u, _ in rays), default=0.0)
        behind = min((u[0] for u, _ in rays), default=0.0)
        rays.sort(key=lambda ray: (ray[0][0] != ahead, ray[0][0] != behind, *(-ray[0]).round(6)))
        origin = Columns(*(np.zeros_like(p) for p in (kernel.state.stage, kernel.state.mesh, kernel.state.scalars)))
        directions = tuple(add(origin, *zip(u.tolist(), kernel.vectors, strict=True)) for u, _ in rays)
        return cls(directions, tuple(x for _, x in rays), radius, continuum, unverified)


@dataclass(frozen=True)
class _Value:
    """Reduced map at a point of the kernel: g (d,), its derivative (d, d + 1), the state, the contraction of Newton."""

    g: np.ndarray
    slope: np.ndarray
    state: Columns
    contraction: float


def _reduced(kernel: Kernel, a: np.ndarray, max_iterations: int = 6) -> _Value | None:
    """Newton for F(x0 + Phi a + w) + B g = 0, C w = 0; None when it does not converge."""
    colloc, rows, columns = kernel.colloc, kernel.rows, kernel.columns
    k, g, sizes = len(colloc.free), np.zeros(len(columns)), [1.0]
    x = kernel.moved(a)
    for _ in range(max_iterations):
        lin = colloc.linearize(x)
        if not lin.is_finite:
            return None
        fac = colloc.factor(lin, rows, columns)
        if fac.sign == 0.0:
            return None
        off = (a - kernel.coordinates(x)).tolist()
        y = fac.solve(colloc.right_hand_side(_loaded(lin.residual, g, columns), rows, off))
        x, g = add(x, (1.0, y), keep=k), g + y.scalars[k:]
        sizes.append(colloc.norm(Columns(y.stage, y.mesh, y.scalars[:k])))
        if sizes[-1] < 1e-7:
            break
    else:
        return None
    at = _solved(colloc, x, rows, columns, fac)
    contraction = sizes[2] / sizes[1] if len(sizes) > 2 and sizes[1] > 1e-9 else 0.0
    return None if at is None else _Value(g, at.g, x, contraction)


@dataclass(frozen=True)
class _Model:
    """Polynomial of the reduced map on the ball |a| <= radius, in units of the radius.

    powers : (M, d + 1); coefficients : (M, d); noise : error of the fit relative to the largest value.
    """

    radius: float
    powers: np.ndarray
    coefficients: np.ndarray
    noise: float

    def __call__(self, u: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """g(ratio u)/ratio^2 (P, d) and its derivative with respect to u (P, d, d + 1) at points u (P, d + 1)."""
        weights = ratio ** (self.powers.sum(axis=1) - 2.0)
        values, slopes = _monomials(self.powers, u)
        c = self.coefficients * weights[:, None]
        return values @ c, np.einsum("pmj,md->pdj", slopes, c)


def _monomials(powers: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Monomials (P, M) and their derivatives (P, M, d + 1) at points u (P, d + 1)."""
    n = u.shape[1]
    table = np.stack([u**i for i in range(powers.max() + 1)])
    factors = [table[powers[:, j], :, j].T for j in range(n)]
    lowered = [powers[:, j] * table[np.maximum(powers[:, j] - 1, 0), :, j].T for j in range(n)]
    slopes = [np.prod([lowered[i] if i == j else factors[i] for i in range(n)], axis=0) for j in range(n)]
    return np.prod(factors, axis=0), np.stack(slopes, axis=2)


def _model(kernel: Kernel, largest: float = 0.5) -> _Model | None:
    """Fit of the reduced map and its derivative on a ball small enough for a polynomial to represent it."""
    d = len(kernel.columns)
    degree = 5 if d == 2 else 4
    powers = np.array([
        np.bincount(chosen, minlength=d + 1) for n in range(2, degree + 1)
        for chosen in combinations_with_replacement(range(d + 1), n)
    ])  # fmt: skip
    rng = np.random.default_rng(19)
    points = rng.normal(size=(2 * len(powers) // (d + 2) + 4, d + 1))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points *= np.resize([1.0, -0.9, 0.6, -0.4], len(points))[:, None]
    values, slopes = _monomials(powers, points)
    matrix = np.concatenate([values, *np.moveaxis(slopes, 2, 0)])
    radius = largest
    for _ in range(12):
        samples = list(_sampled(kernel, radius, points))
        if len(samples) == len(points):
            g, dg = np.array([s.g for s in samples]), radius * np.array([s.slope for s in samples])
            right = np.concatenate([g, *np.moveaxis(dg, 2, 0)])
            coefficients = np.linalg.lstsq(matrix, right, rcond=None)[0]
            size = float(np.abs(right).max())
            noise = float(np.abs(matrix @ coefficients - right).max()) / max(size, 1e-300)
            if noise < 1e-7:
                return _Model(radius, powers, coefficients / max(size, 1e-300), noise)
        radius /= 2
    return None


def _sampled(kernel: Kernel, radius: float, points: np.ndarray) -> Iterator[_Value]:
    """The reduced map at points in units of the radius, until one shows that the radius is too large."""
    for u in points:
        at = _reduced(kernel, radius * u)
        if at is None or at.contraction > 0.2:
            return
        yield at


def _sphere_zeros(model: _Model, ratio: float) -> tuple[list[np.ndarray], list[bool]]:
    """Zeros of the model on the sphere |u| = 1, one of each curve of zeros; whether each belongs to a curve.

    Newton from points spread evenly and from points near coordinate planes, where branches of pitchfork type lie.
    """
    rng, n = np.random.default_rng(23), model.powers.shape[1]
    starts = rng.normal(size=(100 * n * n, n))
    starts[::2] *= 10.0 ** -rng.uniform(0, 3, size=(len(starts[::2]), n))
    u, good = _projected(model, ratio, starts / np.linalg.norm(starts, axis=1)[:, None])
    u = u[good]
    distinct: list[np.ndarray] = []
    for v in u:
        if not distinct or np.linalg.norm(np.array(distinct) - v, axis=1).min() > 1e-4:
            distinct.append(v)
    if not distinct:
        return [], []
    found = np.array(distinct)
    curved = _moves(model, ratio, found)
    zeros, flags = list(found[~curved]), [False] * int((~curved).sum())
    family = found[curved]
    while len(family):  # chains of neighbours are one family
        inside = np.zeros(len(family), dtype=bool)
        inside[0], size = True, 0
        while inside.sum() > size:
            size = int(inside.sum())
            distance = np.linalg.norm(family[:, None] - family[None, inside], axis=2).min(axis=1)
            inside = distance < 0.3
        zeros.append(family[0])
        flags.append(True)
        family = family[~inside]
    return zeros, flags


def _projected(
    model: _Model, ratio: float, start: np.ndarray, across: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Newton onto the zeros on the unit sphere (and on the planes across . (u - start) = 0), and where it converged.

    Singular values below the noise of the model are left out, so that curves of zeros are reached too.
    """
    noise = max(1e-13, model.noise)
    u, good, active = start.copy(), np.zeros(len(start), dtype=bool), np.arange(len(start))
    for _ in range(40):
        here = u[active]
        g, slope = model(here, ratio)
        values = np.concatenate([g, (np.einsum("pj,pj->p", here, here)[:, None] - 1) / 2], axis=1)
        matrix = np.concatenate([slope, here[:, None, :]], axis=1)
        if across is not None:
            normal = across[active]
            values = np.concatenate([values, np.einsum("pj,pj->p", normal, here - start[active])[:, None]], axis=1)
            matrix = np.concatenate([matrix, normal[:, None, :]], axis=1)
        step = -np.einsum("pij,pj->pi", np.linalg.pinv(matrix, rcond=10 * noise), values)
        size = np.linalg.norm(step, axis=1)
        good[active] = (size < 1e-7) & (np.abs(values).max(axis=1) < 30 * noise)
        u[active] = here + step * np.minimum(1.0, 0.4 / np.maximum(size, 1e-300))[:, None]
        active = active[~good[active]]
        if not len(active):
            break
    return u, good


def _moves(model: _Model, ratio: float, u: np.ndarray, by: float = 0.1) -> np.ndarray:
    """Which zeros can be moved along the sphere, in the direction in which the map changes least, and stay zeros."""
    _, slope = model(u, ratio)
    matrix = np.concatenate([slope, u[:, None, :]], axis=1)
    normal = np.linalg.svd(matrix)[2][:, -1]
    normal = normal - np.einsum("pj,pj->p", normal, u)[:, None] * u
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return _projected(model, ratio, u + by * normal, normal)[1]


def _family(kernel: Kernel, a: np.ndarray, by: float = 0.1) -> tuple[np.ndarray, Columns] | None:
    """Direction and state of a zero that the reduced map itself lets move along the sphere, else None."""
    radius, at = float(np.linalg.norm(a)), _reduced(kernel, a)
    if at is None:
        return None
    normal = np.linalg.svd(np.vstack([at.slope, a / radius]))[2][-1]
    moved: _Value | None = at
    b = a + by * radius * normal
    for _ in range(6):
        moved = _reduced(kernel, b)
        if moved is None:
            return None
        if np.abs(moved.g).max() < 1e-9 * radius * np.abs(moved.slope).max():
            return a / radius, at.state
        matrix = np.vstack([moved.slope, b / radius, normal])
        off = [*moved.g, (b @ b / radius - radius) / 2, normal @ (b - a) - by * radius]
        b = b - np.linalg.lstsq(matrix, np.array(off), rcond=1e-12)[0]
    return None


def _confirmed(kernel: Kernel, model: _Model, u: np.ndarray, ratio: float) -> tuple[np.ndarray, Columns] | None:
    """Direction (d + 1,) at the point, and a state, of the ray near the zero u of the model.

    The ray is followed over spheres of the radius, its half and its quarter. Where the equations are so nearly linear
    that round-off hides it there, larger spheres are tried.
    """
    for factor in (1.0, 2.0, 4.0):
        units, states, models = [], [], [u]
        for size in (factor, factor / 2, factor / 4):
            v, good = _projected(model, ratio * size, models[-1][None])
            models.append(v[0] if good[0] else models[-1])
            radius = ratio * size * model.radius
            start = _reduced(kernel, radius * models[-1])
            result = start and newton(kernel.colloc, start.state, [_sphere(kernel, radius)], _SPHERE)
            if not (result and result.converged):
                break
            a = kernel.coordinates(result.state)
            units.append(a / np.linalg.norm(a))
            states.append(result.state)
        turns = [float(np.linalg.norm(p - q)) for p, q in zip(units, [models[1], *units], strict=False)]
        if len(turns) == 3 and turns[0] < 0.1 and turns[1] < 0.3 and turns[2] < 0.8 * turns[1] + 1e-6:
            limit = (8 * units[2] - 6 * units[1] + units[0]) / 3  # to third order in the radius
            return limit / np.linalg.norm(limit), states[0]
    return None


_SPHERE = NewtonOptions(tolerance=1e-10, max_iterations=10)


def _sphere(kernel: Kernel, radius: float) -> Callable[[Columns], tuple[float, Row]]:
    """Condition |a| = radius on the kernel coordinates."""

    def condition(x: Columns) -> tuple[float, Row]:
        a = kernel.coordinates(x)
        size = float(np.linalg.norm(a))
        row = kernel.colloc.row(_combined(kernel.vectors, a / size))
        return size - radius, row

    return condition
