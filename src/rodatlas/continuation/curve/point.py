"""A point of a branch as the walker needs it: state, tangent and test functions on one discretisation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.options import TraceOptions
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.newton import NewtonCode, NewtonResult, fixed, is_singular_around, newton, plane
from rodatlas.continuation.discrete.random_fields import displacement, load_on_equations
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.discrete.vectors import add, predicted, scaled
from rodatlas.continuation.linear.matrix import Columns, Factorization
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.singular.augmented import kernel_directions
from rodatlas.continuation.singular.ray_start import ray_at
from rodatlas.continuation.singular.smallest import smallest_singulars
from rodatlas.continuation.symmetric.isotropy import restrict, symmetric_mesh

FADING = 0.9  # of the steepness from one step to the next


@dataclass(frozen=True)
class Frame:
    """State x and unit tangent t on a discretisation, with what was learnt in reaching it.

    `branch_test` is sign and log|det| of the bordered matrix; `previous` and `previous_step` serve the quadratic
    predictor; `error` is the last error estimate. `modes` approximates the two directions in which the bordered matrix
    is nearest to singular, `weakness` and `second_weakness` are its singular values there, `weakness_before` the first
    one of the point before; it is negative when a branch point was passed since. `steepness` is how fast the smallest
    singular value changed lately, per arclength. `with_mode` says that the mesh follows `ahead` too, modes of the next
    branch points, or the weakest one where none are known; `expected` are their distances along the curve.
    """

    colloc: Collocation
    x: Columns
    tangent: Columns
    branch_test: tuple[float, float]
    previous: Columns | None = None
    previous_step: float = 1.0
    error: float = float("nan")
    modes: tuple[Columns, ...] | None = None
    weakness: float = float("nan")
    second_weakness: float = float("nan")
    weakness_before: float = float("nan")
    steepness: float = float("nan")
    with_mode: bool = False
    ahead: tuple[Columns, ...] = ()
    expected: tuple[float, ...] = ()

    @property
    def weakest(self) -> Columns | None:
        return None if self.modes is None else self.modes[0]

    @property
    def parameter(self) -> float:
        return float(self.x.scalars[0])

    @property
    def fold_test(self) -> float:
        return float(self.tangent.scalars[0])

    def predict(self, step: float) -> Columns:
        """Where the curve is expected after a step."""
        return predicted(self.x, self.tangent, step, self.previous, self.previous_step)

    def reached(self, state: Columns, fac: Factorization, step: float) -> Frame:
        """The frame at a corrected state, whose last matrix was bordered with this frame's tangent."""
        t = unit_tangent(self.colloc, fac, self.tangent)
        modes, (first, second) = smallest_singulars(self.colloc, fac, self.modes) or (self.modes, (0.0, 0.0))
        change = abs(fac.sign * first - self.branch_test[0] * self.weakness) / step
        return Frame(
            self.colloc, state, t, (fac.sign, fac.log_det), self.tangent, step, self.error, modes, first, second,
            self.weakness, float(np.fmax(change, FADING * self.steepness)), self.with_mode,
            self.ahead, tuple(d - step for d in self.expected),
        )  # fmt: skip

    def reversed(self) -> Frame:
        """The same point, looking the other way."""
        sign, log_det = self.branch_test
        turned = scaled(self.tangent, -1.0)
        return replace(
            self, tangent=turned, branch_test=(-sign, log_det), previous=None, weakness_before=float("nan"),
            expected=tuple(-d for d in self.expected),
        )  # fmt: skip

    def on_mesh(self, mesh: np.ndarray) -> Frame:
        """The frame interpolated on another mesh; the state is to be corrected there."""
        old = self.colloc
        new = old.on(mesh)
        carry = old.carrier(new)
        previous = None if self.previous is None else carry(self.previous)
        modes = None if self.modes is None else tuple(map(carry, self.modes))
        x, tangent = carry(self.x), carry(self.tangent)
        new.hold(x, new.phase, tangent)
        return replace(
            self, colloc=new, x=x, tangent=tangent, previous=previous, modes=modes, ahead=tuple(map(carry, self.ahead))
        )


def unit_tangent(colloc: Collocation, fac: Factorization, along: Columns) -> Columns:
    """Unit tangent with <tangent, along> > 0 from a matrix bordered with `along`."""
    v = colloc.kept_symmetric(fac.solve(colloc.right_hand_side(None, [colloc.row(along)], [1.0])))
    return scaled(v, 1.0 / colloc.norm(v))


def first_frame(
    bvp: BVP, solution: Solution, free: list[int], options: TraceOptions, scale: Scale | None = None
) -> tuple[Frame | None, NewtonResult]:
    """Correct a start solution at its own parameter values and find the tangent, pointing to a larger parameter.

    A start at a fold is corrected in another direction than the parameter's. At a branch point the tangent is that
    of the branch along which the parameter changes most, and the frame's determinant is zero.
    """
    scale = scale or Scale.of(bvp, solution)
    if options.within:
        solution = solution.remesh(symmetric_mesh(solution.mesh))
    colloc = Collocation.at(bvp, solution, free, scale, options.backend)
    x = restrict(colloc, options.within, colloc.state(solution))
    name = bvp.parameter_names[free[0]]
    held = fixed(name, solution.parameter(name))(colloc)
    failed = None
    directions = _directions(colloc, x, len(free))
    for i, guess in enumerate(directions):
        result = newton(colloc, x, [plane(colloc, guess, x) if i else held], options.newton)
        if not result.converged:
            failed = failed or result
            continue
        if failed and abs(result.state.scalars[0] - x.scalars[0]) > 1e-6:
            break  # a solution, but at another value of the parameter
        fac = colloc.factor(colloc.linearize(result.state), [colloc.row(guess)])
        if fac.sign != 0.0:
            frame = with_tests(Frame(colloc, result.state, unit_tangent(colloc, fac, guess), (0.0, 0.0)))
            if _is_regular(frame):
                return frame, result
            return _at_branch_point(colloc, frame.x, guess, options) or frame, result
        failed = failed or replace(result, code=NewtonCode.SINGULAR)
    assert failed is not None
    if failed.code is NewtonCode.SINGULAR:
        return _at_branch_point(colloc, x, directions[0], options), failed
    return None, failed


def _directions(colloc: Collocation, x: Columns, k: int) -> list[Columns]:
    """Directions to try for the first tangent: the parameter, then (at a fold) a smooth change of the unknowns."""
    parameter = Columns(np.zeros_like(x.stage), np.zeros_like(x.mesh), np.eye(k)[0])
    return [parameter, replace(displacement(colloc, np.random.default_rng(3), k), scalars=np.zeros(k))]


def _is_regular(frame: Frame) -> bool:
    """Whether the bordered matrix is far from singular; at a branch point the tangent is round-off.

    Its inverse, applied to a smooth right-hand side, tells.
    """
    colloc, x = frame.colloc, frame.x
    row = colloc.row(frame.tangent)
    fac = colloc.factor(colloc.linearize(x), [row])
    if fac.sign == 0.0:
        return False
    rhs = colloc.right_hand_side(None, [row], [1.0])
    load = load_on_equations(colloc, np.random.default_rng(5), 2)
    return colloc.norm(fac.solve(replace(rhs, stage=load))) < 1e6


def _at_branch_point(colloc: Collocation, x: Columns, along: Columns, options: TraceOptions) -> Frame | None:
    """Frame at a simple or multiple branch point very close to x, with the tangent nearest `along`; None without it."""
    found = kernel_directions(colloc, x, along)
    if found is not None and colloc.norm(add(found[0], (-1.0, x))) < 1e-4:
        return Frame(colloc, found[0], found[1][0], (0.0, -np.inf))
    if is_singular_around(colloc, x, colloc.row(along)):
        return None
    ray = ray_at(colloc, x, along, options.mesh)
    if ray is None:
        return None
    there, state, tangent = ray
    before = x if there is colloc else colloc.interpolate(x, there)
    return Frame(there, state, tangent, (0.0, -np.inf)) if there.norm(add(state, (-1.0, before))) < 1e-4 else None


def with_tests(frame: Frame, passes: int = 1) -> Frame:
    """Evaluate the bordered determinant with the frame's own tangent, and how close to singular the matrix is."""
    colloc = frame.colloc
    fac = colloc.factor(colloc.linearize(frame.x), [colloc.row(frame.tangent)])
    found = smallest_singulars(colloc, fac, frame.modes, passes=passes)
    modes, (first, second) = found or (frame.modes, (0.0, 0.0))
    return replace(
        frame, branch_test=(fac.sign, fac.log_det), modes=modes, weakness=first, second_weakness=second
    )  # fmt: skip
