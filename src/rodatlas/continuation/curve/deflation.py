r"""More solutions at fixed parameters, by deflating the ones that are known.

Newton's method runs on :math:`\eta(u) F(u) = 0` with

.. math:: \eta(u) = \prod_i \left( \|u - u_i\|^{-p} + \alpha \right),

which grows without bound at the known solutions :math:`u_i`, so the iteration cannot return to them, while every other
solution of F = 0 stays one. No further factorization is needed: with the ordinary Newton correction d, that is
F'd = -F, and g the gradient of :math:`\log \eta`, the correction of the deflated problem,
:math:`(F' + F g^T)\,\delta = -F`, is along d,

.. math:: \delta = \tau d, \qquad \tau = 1 / (1 - g \cdot d).

Close to a known solution, where d = -(u - u_i) and g.d = p, it is tau = -1 for p = 2: each step doubles the distance.

Source: P. E. Farrell, A. Birkisson & S. W. Funke, "Deflation techniques for finding distinct solutions of nonlinear
partial differential equations", SIAM J. Sci. Comput. 37 (2015) A2026.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np

from rodatlas.continuation.checks import check_each, check_function, check_type, check_whole, shown
from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.curve.start import NotConverged, free_or_only
from rodatlas.continuation.curve.trace import solve
from rodatlas.continuation.discrete.collocation import Collocation, Scale, free_indices
from rodatlas.continuation.discrete.newton import Condition, NewtonCode, fixed, newton
from rodatlas.continuation.discrete.random_fields import load_on_equations
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization
from rodatlas.continuation.problem.bvp import BVP

Image = Callable[[Solution], Solution]
"""A symmetry of the problem: it maps solutions to solutions at the same parameters."""

MAX_ITERATIONS = 30
LARGEST_STEPS = (2.0, 0.5)  # one after the other, in scaled variables, in which a solution is of order one
TAKE_OVER = 1e-3  # ordinary correction, against the distance to a known solution, from which Newton converges alone
MOST_IMAGES = 64
NEAR = 1e-2  # solutions closer than this are compared on one mesh, on which they differ by more than SAME, or are equal
SAME = 1e-6
MODES, RANDOM, AMPLITUDES = 3, 2, (0.3, 1.0)  # perturbations of a solution, and their sizes in scaled variables
WAVES = 4  # cosines in a smooth random load


@dataclass(frozen=True)
class Deflation:
    r"""The deflation factor of known states on one discretisation.

    Attributes
    ----------
    colloc : its norm is the mesh-independent one of the solution and of the inner free parameters, scaled.
    known : states that are deflated.
    power, shift : p and :math:`\alpha`.
    """

    colloc: Collocation
    known: tuple[Columns, ...]
    power: float = 2.0
    shift: float = 1.0

    def nearest(self, x: Columns) -> float:
        """Distance to the nearest known state."""
        return min((self.colloc.norm(add(x, (-1.0, k))) for k in self.known), default=np.inf)

    def slope(self, x: Columns, d: Columns) -> float:
        r"""Derivative of :math:`\log \eta` at x along d.

        .. math:: -\sum_i \frac{p \langle x - x_i, d \rangle}{r_i^2 (1 + \alpha r_i^p)}, \qquad r_i = \|x - x_i\|
        """
        total = 0.0
        for k in self.known:
            e = add(x, (-1.0, k))
            r2 = self.colloc.inner(e, e)
            total -= self.power * self.colloc.inner(e, d) / (r2 * (1.0 + self.shift * r2 ** (self.power / 2)))
        return total


def deflated_solve(
    bvp: BVP, guess: Solution, known: Sequence[Solution], free: Sequence[str] | None = None,
    options: TraceOptions | None = None, *, power: float = 2.0, shift: float = 1.0,
) -> Solution:  # fmt: skip
    """One more solution at the parameters of the guess, on a mesh that meets the tolerance.

    Parameters
    ----------
    guess : Solution
        where the iteration starts; it may be close to a known solution but not one of them.
    known : solutions at the same parameters, which are not to be found again.
    free : names of bvp.n_free parameters, as in :func:`rodatlas.continuation.solve`: the first is held, the others are
        solved for.
    power, shift : p and alpha of the deflation factor.

    Raises
    ------
    NotConverged
        when the iteration does not settle, or settles on a known solution.
    ValueError
        when a known solution has other parameters than the guess, or `power` or `shift` is out of range.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_type("guess", guess, Solution, "a Solution")
    check_each("known", known, Solution, "a sequence of Solutions")
    _check_factor(power, shift)
    options = TraceOptions.given(options)
    free = _names(bvp, free)
    _check_parameters(guess, known, free)
    where = f"deflated Newton from {guess!r}"
    colloc = _discretized(bvp, guess, known, free, options)
    deflation = Deflation(colloc, tuple(colloc.state(k) for k in known), power, shift)
    held = fixed(free[0], guess.parameter(free[0]))(colloc)
    failed = NotConverged(NewtonCode.SLOW, where)
    for largest_step in LARGEST_STEPS:
        code, x = deflated_newton(deflation, colloc.state(guess), held, largest_step)
        if code is not NewtonCode.CONVERGED:
            failed = NotConverged(code, where)
            continue
        try:
            found = solve(bvp, colloc.solution(x), free, options)
        except NotConverged as error:
            failed = error
            continue
        stays = abs(found.parameter(free[0]) - guess.parameter(free[0])) < SAME
        if stays and not is_known(bvp, found, known, free, options):
            return found
        failed = NotConverged(NewtonCode.SLOW, f"{where}, back at a known solution")
    raise failed


def other_solutions(
    bvp: BVP, known: Sequence[Solution], free: Sequence[str] | None = None, options: TraceOptions | None = None, *,
    guesses: Sequence[Solution] | None = None, limit: int = 20, images: Sequence[Image] = (), power: float = 2.0,
    shift: float = 1.0,
) -> list[Solution]:  # fmt: skip
    """Solutions at the parameters of the known ones, searched by repeated deflation until nothing more is found.

    Each guess is used until it leads to no further solution: first the given ones, then perturbations of every known
    or found solution along the lowest modes of its linearised problem and by its response to smooth random loads. The
    search is repeatable, but no proof that there are no other solutions.

    Parameters
    ----------
    known : at least one solution; all at the same parameters.
    free : as in :func:`deflated_solve`.
    guesses : further places to start from; their parameters are set to those of the known solutions.
    limit : number of new solutions after which the search stops.
    images : symmetries of the problem; the image of a known or found solution counts as known.

    Returns
    -------
    the new solutions, in the order in which they were found; of those that are images of each other only one.
    """
    check_type("bvp", bvp, BVP, "a BVP")
    check_each("known", known, Solution, "a sequence of Solutions")
    if not known:
        raise ValueError("known: expected at least one solution, got none")
    _check_factor(power, shift)
    if guesses is not None:
        check_each("guesses", guesses, Solution, "a sequence of Solutions")
    check_whole("limit", limit, 0, "a whole number of at least 0")
    check_each("images", images, object, "a sequence of functions of a solution")
    for map_of in images:
        check_function("images", map_of)
    options = TraceOptions.given(options)
    free = _names(bvp, free)
    _check_parameters(known[0], known, free)
    deflated = [image for s in known for image in _orbit(bvp, s, images, free, options)]
    found: list[Solution] = []
    queue = [*known]
    starts: Iterator[Solution] = (_at(g, known[0], free) for g in guesses or ())
    while True:
        for start in starts:
            while len(found) < limit:
                try:
                    new = deflated_solve(bvp, start, deflated, free, options, power=power, shift=shift)
                except NotConverged:
                    break
                found.append(new)
                queue.append(new)
                deflated += _orbit(bvp, new, images, free, options)
        if not queue or len(found) >= limit:
            return found
        starts = perturbed(bvp, queue.pop(0), free, options)


def _check_factor(power: object, shift: object) -> None:
    numbers = all(isinstance(x, Real) and not isinstance(x, bool) and x < np.inf for x in (power, shift))
    if not (numbers and power >= 1 and shift >= 0):  # type: ignore[operator]
        raise ValueError(
            f"power, shift: expected finite numbers power >= 1 and shift >= 0, got {shown(power)}, {shown(shift)}"
        )


def deflated_newton(
    deflation: Deflation, x: Columns, held: Condition, largest_step: float, max_iterations: int = MAX_ITERATIONS
) -> tuple[NewtonCode, Columns]:
    """Newton on the deflated problem, until an ordinary iteration can take over.

    That is when the ordinary correction is small against the distance to the nearest known solution. Steps are cut to
    `largest_step`, and not otherwise damped: a search that insists on descent stays in the valley of the solution that
    was deflated, and finds fewer others.
    """
    colloc = deflation.colloc
    for _ in range(max_iterations):
        with np.errstate(all="ignore"):
            lin = colloc.linearize(x)
        value, row = held(x)
        if not (lin.is_finite and np.isfinite(value)):
            return NewtonCode.NOT_FINITE, x
        fac = colloc.factor(lin, [row])
        if fac.sign == 0.0:
            return NewtonCode.SINGULAR, x
        d = fac.solve(colloc.right_hand_side(lin.residual, [row], [-value]))
        size, gap = colloc.norm(d), deflation.nearest(x)
        if not np.isfinite(size) or gap == 0.0:
            return NewtonCode.SINGULAR, x
        if size < TAKE_OVER * min(gap, 1.0):
            return NewtonCode.CONVERGED, add(x, (1.0, d))
        # tau d, cut to the largest step; 1/tau may vanish
        inverse = 1.0 - deflation.slope(x, d)
        x = add(x, (float(np.copysign(1.0, inverse)) / max(abs(inverse), size / largest_step), d))
    return NewtonCode.SLOW, x


def is_known(
    bvp: BVP, solution: Solution, known: Sequence[Solution], free: Sequence[str], options: TraceOptions
) -> bool:
    """Whether a solution is one of the known ones.

    Distances are measured in the mesh-independent norm; those that are small are measured again after the known
    solution was corrected on the other's mesh, which takes away the error of interpolation.
    """
    colloc = _collocation(bvp, solution.mesh, solution, [solution, *known], free, options)
    x = colloc.state(solution)
    held = fixed(free[0], solution.parameter(free[0]))(colloc)
    for other in known:
        y = colloc.state(other)
        distance = colloc.norm(add(x, (-1.0, y)))
        if distance < NEAR:
            corrected = newton(colloc, y, [held], options.newton)
            if corrected.converged:
                distance = colloc.norm(add(x, (-1.0, corrected.state)))
        if distance < max(SAME, 10 * options.newton.tolerance):
            return True
    return False


def perturbed(bvp: BVP, solution: Solution, free: Sequence[str], options: TraceOptions) -> Iterator[Solution]:
    r"""Guesses around a solution: along its lowest modes, then along responses to smooth random loads.

    The first guesses are the roots of the reduced equation :math:`a\, w F' v + \tfrac12 a^2\, w F''[v, v] = 0` on each
    mode v with left vector w: close to a fold or transcritical point, that is where the other solution is.
    """
    colloc = _discretized(bvp, solution, (), free, options)
    x = colloc.state(solution)
    _, row = fixed(free[0], solution.parameter(free[0]))(colloc)(x)
    fac = colloc.factor(colloc.linearize(x), [row])
    if fac.sign == 0.0:
        return
    rng = np.random.default_rng(17)
    modes = lowest_modes(colloc, fac, rng)
    for mode in modes:
        curvature = colloc.second(x, mode, _left(colloc, fac, mode)).dot(mode)  # here w F' v = 1
        if abs(curvature) * max(AMPLITUDES) > 2.0:
            yield colloc.solution(add(x, (-2.0 / curvature, mode)))
    directions = [*modes, *(_response(colloc, fac, rng) for _ in range(RANDOM))]
    for amplitude in AMPLITUDES:
        for direction in directions:
            for side in (1.0, -1.0):
                yield colloc.solution(add(x, (side * amplitude, direction)))


def lowest_modes(colloc: Collocation, fac: Factorization, rng: np.random.Generator) -> list[Columns]:
    """Right singular vectors of the smallest singular values, orthonormal, by inverse subspace iteration.

    Norms are those of functions on both sides, so the modes do not depend on the mesh.
    """
    modes = [_response(colloc, fac, rng) for _ in range(MODES)]
    per_length = (colloc.step[:, None] / colloc.scheme.weights)[..., None]
    for _ in range(4):
        lefts = [_left(colloc, fac, mode) for mode in modes]
        images = [Blocks(per_length * w.stage, 0 * w.chain, 0 * w.ends, 0 * w.dense) for w in lefts]
        modes = _orthonormal(colloc, [fac.solve(image) for image in images])
    return modes


def _left(colloc: Collocation, fac: Factorization, mode: Columns) -> Blocks:
    """Left vector w of a mode: w K = <mode, .> for the factored matrix K."""
    row = colloc.row(mode)
    assert row.stage is not None
    return fac.solve_transposed(Columns(row.stage, np.zeros_like(mode.mesh), row.scalars))


def _orthonormal(colloc: Collocation, vectors: Sequence[Columns]) -> list[Columns]:
    """Gram-Schmidt in the order of the vectors; what is left of dependent ones is dropped."""
    out: list[Columns] = []
    for v in vectors:
        size = colloc.norm(v)
        for u in out:
            v = add(v, (-colloc.inner(u, v), u))
        if colloc.norm(v) > 1e-8 * size:
            out.append(scaled(v, 1.0 / colloc.norm(v)))
    return out


def _response(colloc: Collocation, fac: Factorization, rng: np.random.Generator) -> Columns:
    """Unit response of the linearised problem to a smooth random load on its differential equations."""
    bvp, load = colloc.bvp, load_on_equations(colloc, rng, WAVES)
    chain = np.zeros((len(colloc.step), bvp.size))
    v = fac.solve(Blocks(load, chain, np.zeros(bvp.n_boundary + 1), np.zeros(bvp.n_integral)))
    return scaled(v, 1.0 / colloc.norm(v))


def _discretized(
    bvp: BVP, guess: Solution, known: Sequence[Solution], free: Sequence[str], options: TraceOptions
) -> Collocation:
    """Collocation half-way between the guess's mesh and a uniform one: another solution may need other places."""
    fewest, most = options.mesh.intervals
    places = np.linspace(0.0, 1.0, int(np.clip(guess.intervals, max(fewest, min(20, most)), most)) + 1)
    mesh = (np.interp(places, np.linspace(0.0, 1.0, len(guess.mesh)), guess.mesh) + places) / 2
    return _collocation(bvp, mesh, guess, [guess, *known], free, options)


def _collocation(
    bvp: BVP, mesh: np.ndarray, at: Solution, solutions: Sequence[Solution], free: Sequence[str], options: TraceOptions
) -> Collocation:
    """Discretisation at the parameters of `at`, in units that suit all the solutions."""
    units = np.max([Scale.of(bvp, s).unknowns for s in solutions], axis=0)
    scale = Scale(units, Scale.of(bvp, at).parameters)
    return Collocation(
        bvp, mesh, options.mesh.points, at.parameters, free_indices(bvp, free), scale, options.backend
    )  # fmt: skip


def _orbit(
    bvp: BVP, solution: Solution, images: Sequence[Image], free: Sequence[str], options: TraceOptions
) -> list[Solution]:
    """The solution and all its images, also those of images."""
    orbit = [solution]
    for member in orbit:  # grows on the way
        for image in images:
            other = image(member)
            if len(orbit) < MOST_IMAGES and not is_known(bvp, other, orbit, free, options):
                orbit.append(other)
    return orbit


def _names(bvp: BVP, free: Sequence[str] | None) -> Sequence[str]:
    free = free_or_only(bvp, free)
    free_indices(bvp, free)
    return free


def _at(guess: Solution, like: Solution, free: Sequence[str]) -> Solution:
    """A guess with the parameters of another solution, except those that are solved for."""
    return guess.with_parameters(**{k: like.parameter(k) for k in like.parameter_names if k not in free[1:]})


def _check_parameters(guess: Solution, known: Sequence[Solution], free: Sequence[str]) -> None:
    for solution in known:
        for name in guess.parameter_names:
            value, wanted = solution.parameter(name), guess.parameter(name)
            if name not in free[1:] and abs(value - wanted) > SAME * max(1.0, abs(wanted)):
                raise ValueError(f"known: expected solutions at {name} = {wanted:.8g}, got one at {value:.8g}")
