r"""All branches through a multiple branch point: zeros of the reduced map g on the kernel (Lyapunov-Schmidt).

For a in R^(d+1) solve :math:`F(x_0 + \Phi a + w) + B g = 0,\ C w = 0`; the derivative of g is the block G of
:mod:`rodatlas.continuation.singular.kernel`. On small spheres |a| = r the zeros of g are isolated points, one for each
ray of a branch, or curves where a continuous symmetry moves the branches around.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from rodatlas.continuation.discrete.collocation import Row
from rodatlas.continuation.discrete.newton import newton
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.singular import families
from rodatlas.continuation.singular.bordered import BorderedSystem, loaded
from rodatlas.continuation.singular.kernel import Kernel, combined

AT_REST = 0.01  # distance of the states that stand for the branch walked, where nothing else can be told apart
FITTED = 1e-7  # error of the fit, relative to the largest value, that is good enough
SETTLED = 1e-4  # turn of a ray from one sphere to a smaller one that may be the error of the point itself
EXACT = 1e-10  # last correction: the slope, of second order in a small distance, belongs to the iterate before it


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
        if families.is_at_rest(kernel):
            v, x = kernel.vectors[0], kernel.state
            ends = [scaled(v, sign) for sign in (1.0, -1.0)]
            return cls(tuple(ends), tuple(add(x, (AT_REST, w)) for w in ends), float("nan"), True, 0)
        model = _model(kernel)
        if model is None:
            return cls((), (), float("nan"), False, 1)
        radius, ratio = model.radius / 8, 1.0 / 8
        rays: list[tuple[np.ndarray, Columns]] = []
        unverified, continuum, declared = 0, False, families.actions(kernel)
        for u, may_move in zip(*_sphere_zeros(model, ratio, declared), strict=True):
            at = _reduced(kernel, radius * u) if may_move and declared else None
            family = families.member(kernel, at.state, radius) if at else None
            family = family or (_family(kernel, radius * u) if may_move else None)
            continuum |= family is not None
            ray = family or _confirmed(kernel, model, u, ratio)
            if ray is None:
                unverified += 1
            elif not any(kernel.colloc.norm(add(ray[1], (-1.0, x))) < 1e-5 * radius for _, x in rays):
                rays.append(ray)
        ahead = max((u[0] for u, _ in rays), default=0.0)
        behind = min((u[0] for u, _ in rays), default=0.0)
        rays.sort(key=lambda ray: (ray[0][0] != ahead, ray[0][0] != behind, *(-ray[0]).round(6)))
        rays = rays[:2] + _paired(rays[2:])
        origin = Columns(*(np.zeros_like(p) for p in (kernel.state.stage, kernel.state.mesh, kernel.state.scalars)))
        directions = tuple(add(origin, *zip(u.tolist(), kernel.vectors, strict=True)) for u, _ in rays)
        return cls(directions, tuple(x for _, x in rays), radius, continuum, unverified)


def _paired(rays: list[tuple[np.ndarray, Columns]]) -> list[tuple[np.ndarray, Columns]]:
    """Rays in opposite directions, the two sides of a curve, one after the other."""
    left, pairs = list(rays), list[tuple[np.ndarray, Columns]]()
    while left:
        pairs.append(left.pop(0))
        facing = [float(pairs[-1][0] @ u) for u, _ in left]
        if left and min(facing) < -0.99:
            pairs.append(left.pop(int(np.argmin(facing))))
    return pairs


@dataclass(frozen=True)
class _Value:
    """Reduced map at a point of the kernel: g (d,), its derivative (d, d + 1), the state, the contraction of Newton."""

    g: np.ndarray
    slope: np.ndarray
    state: Columns
    contraction: float


def _reduced(kernel: Kernel, a: np.ndarray, max_iterations: int = 7) -> _Value | None:
    """Newton for F(x0 + Phi a + w) + B g = 0, C w = 0; None when it does not converge."""
    colloc, rows, columns = kernel.colloc, kernel.rows, kernel.columns
    g, sizes = np.zeros(len(columns)), [1.0]
    x = kernel.moved(a)
    for _ in range(max_iterations):
        lin = colloc.linearize(x)
        if not lin.is_finite:
            return None
        b = BorderedSystem(colloc, lin, rows, columns)
        if b.is_singular:
            return None
        y, shares = b.solved(loaded(lin.residual, g, columns), (a - kernel.coordinates(x)).tolist())
        x, g = add(x, (1.0, y)), g + shares
        sizes.append(colloc.norm(y))
        if sizes[-1] < EXACT or (sizes[-1] < 1e-7 and sizes[-1] > 0.3 * sizes[-2]):
            break
    else:
        return None
    contraction = sizes[2] / sizes[1] if len(sizes) > 2 and sizes[1] > 1e-9 else 0.0
    return _Value(g, b.kernel()[1], x, contraction)


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
    """Fit of the reduced map and its derivative on a ball small enough for a polynomial to represent it.

    Constant and linear terms are those of round-off in the place of the point; they are fitted and left out.
    """
    d = len(kernel.columns)
    degree = 5 if d == 2 else 4
    powers = np.array([
        np.bincount(chosen, minlength=d + 1) for n in range(degree + 1)
        for chosen in combinations_with_replacement(range(d + 1), n)
    ])  # fmt: skip
    kept = powers.sum(axis=1) > 1
    rng = np.random.default_rng(19)
    points = rng.normal(size=(2 * len(powers) // (d + 2) + 4, d + 1))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points *= np.resize([1.0, -0.9, 0.6, -0.4], len(points))[:, None]
    values, slopes = _monomials(powers, points)
    matrix = np.concatenate([values, *np.moveaxis(slopes, 2, 0)])
    inverse = np.linalg.pinv(matrix)
    radius, best = largest, None
    for _ in range(12):
        samples = list(_sampled(kernel, radius, points))
        if len(samples) == len(points):
            g, dg = np.array([s.g for s in samples]), radius * np.array([s.slope for s in samples])
            right = np.concatenate([g, *np.moveaxis(dg, 2, 0)])
            coefficients = inverse @ right
            size = float(np.abs(right).max())
            noise = float(np.abs(matrix @ coefficients - right).max()) / max(size, 1e-300)
            if best is None or noise < best.noise:
                best = _Model(radius, powers[kept], coefficients[kept] / max(size, 1e-300), noise)
            if noise < FITTED:
                break
        radius /= 2
    return best if best is not None and best.noise < 100 * FITTED else None


def _sampled(kernel: Kernel, radius: float, points: np.ndarray) -> Iterator[_Value]:
    """The reduced map at points in units of the radius, until one shows that the radius is too large."""
    for u in points:
        at = _reduced(kernel, radius * u)
        if at is None or at.contraction > 0.2:
            return
        yield at


def _sphere_zeros(model: _Model, ratio: float, declared: list[np.ndarray]) -> tuple[list[np.ndarray], list[bool]]:
    """Zeros of the model on the sphere |u| = 1, one of each curve of zeros; whether each belongs to a curve.

    `declared` are the matrices of declared symmetries, which tell which zeros belong to curves.

    Newton from points spread evenly and from points near coordinate planes, where branches of pitchfork type lie.
    """
    rng, n = np.random.default_rng(23), model.powers.shape[1]
    starts = rng.normal(size=(100 * n * n, n))
    starts[::2] *= 10.0 ** -rng.uniform(0, 3, size=(len(starts[::2]), n))
    u, good = _projected(model, ratio, starts / np.linalg.norm(starts, axis=1)[:, None])
    found = _thinned(u[good], 1e-4)
    if not len(found):
        return [], []
    curved = families.moves(declared, found) if declared else _moves(model, ratio, found)
    zeros, flags = list(found[~curved]), [False] * int((~curved).sum())
    family = _thinned(found[curved], 0.05)
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


def _thinned(points: np.ndarray, gap: float) -> np.ndarray:
    """Points (P, .) that are further apart than a gap: of those that lie closer the first one."""
    kept, count = np.empty_like(points), 0
    for v in points:
        if not count or ((kept[:count] - v) ** 2).sum(axis=1).min() > gap**2:
            kept[count] = v
            count += 1
    return kept[:count]


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
    doubtful: tuple[np.ndarray, Columns] | None = None
    for factor in (1.0, 2.0, 4.0, 8.0):
        units, states, models = [], [], [u]
        for size in (factor, factor / 2, factor / 4):
            v, good = _projected(model, ratio * size, models[-1][None])
            models.append(v[0] if good[0] else models[-1])
            radius = ratio * size * model.radius
            start = _reduced(kernel, radius * models[-1])
            result = start and newton(kernel.colloc, start.state, [_sphere(kernel, radius)], families.ON_SPHERE)
            if not (result and result.converged):
                break
            a = kernel.coordinates(result.state)
            units.append(a / np.linalg.norm(a))
            states.append(result.state)
        turns = [float(np.linalg.norm(p - q)) for p, q in zip(units, [models[1], *units], strict=False)]
        if len(turns) == 3 and turns[0] < 0.1 and turns[1] < 0.3 and turns[2] < 0.8 * turns[1] + SETTLED:
            limit = (8 * units[2] - 6 * units[1] + units[0]) / 3  # to third order in the radius
            found = limit / np.linalg.norm(limit), states[0]
            if turns[2] < 0.8 * turns[1] + 1e-6:
                return found
            doubtful = doubtful or found
    return doubtful


def _sphere(kernel: Kernel, radius: float) -> Callable[[Columns], tuple[float, Row]]:
    """Condition |a| = radius on the kernel coordinates."""

    def condition(x: Columns) -> tuple[float, Row]:
        a = kernel.coordinates(x)
        size = float(np.linalg.norm(a))
        row = kernel.colloc.row(combined(kernel.vectors, a / size))
        return size - radius, row

    return condition
