"""Special points of a locus: what changes sign on a step, where it vanishes, and what happens there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rodatlas.continuation.curve.segment import dips
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.locus.point import LocusFrame, Sought, correct, frame_at
from rodatlas.continuation.locus.segment import LOCATED, Stretch, Test
from rodatlas.continuation.locus.system import UNPROTECTED
from rodatlas.continuation.results.branch import Status
from rodatlas.continuation.results.locus import Effect, LocusEvent
from rodatlas.continuation.singular.extremum import size_of, slope_along
from rodatlas.continuation.singular.normal_form import cusp_form, fold_quadratic

PITCHFORK = 1e-6  # quadratic coefficient below which a branch point is a pitchfork
INTERPOLATED = 1e-6  # largest error in arclength of a special point that is not solved for
PERSISTS = 1e-6  # largest artificial unknown of a branch point that needs no perturbation
SIMPLE = 0.35  # share of its value at the end of a first step that a slope has halfway if it grows from zero linearly
ROUND_OFF = 1e-9  # values of a test function that mean nothing


@dataclass(frozen=True)
class Watched:
    """A test function, what its zero is called, and which parameter is extreme there.

    singular : the equations of the locus are singular there; noise : values that mean nothing; precise and smooth :
        tests for location, and for a pair of zeros or one at the start, where `test` has no value but a sign;
        on_points : on a locus of folds, the test function that vanishes there along the locus of branch points that is
        met, whose equations are regular.
    """

    kind: str
    test: Test
    what: str = ""
    parameter: str = ""
    singular: bool = False
    noise: float = ROUND_OFF
    precise: Callable[[Stretch], Test] | None = None
    smooth: Test | None = None
    on_points: str = ""

    def changes(self, stretch: Stretch) -> bool:
        """Whether it changes sign on a stretch, by more than round-off.

        Zero has a sign, too (in the other direction, that of a tangent's component is the other one): where a locus
        starts at a special point, one of its halves has it.
        """
        left, right = self.test(stretch.left), self.test(stretch.right)
        return bool(np.signbit(left) != np.signbit(right)) and max(abs(left), abs(right)) > ROUND_OFF

    def is_passed(self, stretch: Stretch) -> bool:
        """Whether it vanishes on a stretch: it changes sign, or the locus starts at a zero of it.

        Of what happens to the curve itself, a cusp say, the sign at the start tells enough, whichever way is walked.
        """
        return self._leaves(stretch) if self.begins(stretch) else self.changes(stretch)

    def begins(self, stretch: Stretch) -> bool:
        """Whether the locus starts where it vanishes, of what is watched along the curve."""
        if stretch.left.behind is not None or self.kind.partition(" of ")[0] not in ("extremum", "zero"):
            return False
        left, right = self.test(stretch.left), self.test(stretch.right)
        return abs(left) * stretch.step <= LOCATED * abs(right - left)

    def _leaves(self, stretch: Stretch) -> bool:
        """Whether it grows from the zero at the start by more than round-off; a slope linearly: else it inflects."""
        test = self.smooth or self.test
        right = test(stretch.right)
        if abs(right) < ROUND_OFF or self.kind != "extremum":
            return abs(right) > ROUND_OFF
        middle = stretch.corrected(0.5)
        return middle is not None and test(middle) / right > SIMPLE


def watched(stretch: Stretch, names: tuple[str, ...]) -> list[Watched]:
    """The test functions that vanish on a stretch, each once.

    At a cusp the tangents of both parameters vanish as the quadratic term does: what is extreme beside it is told by
    their ratio.
    """
    found = [w for w in (*_candidates(stretch), *_asked(stretch, names)) if w.is_passed(stretch)]
    turns = [turn for turn in _turns(stretch, names) if turn.is_passed(stretch)]
    if _CUSP not in found:
        return found + turns
    meeting = _meeting(stretch, len(turns))
    if meeting is not None:
        return [meeting if w is _CUSP else w for w in found]
    turned = [turn.parameter for turn in turns]
    beside = [replace(turn, test=_beside_cusp(turn.test)) for turn in _turns(stretch, names)
              if turn.parameter not in turned]  # fmt: skip
    return found + beside


def _plane(sought: Sought) -> int:
    """How many parameters of a locus are no inner ones."""
    return 3 if sought.kind == UNPROTECTED else 2


def _turns(stretch: Stretch, names: tuple[str, ...]) -> list[Watched]:
    return [Watched("extremum", _component(i), "", name) for i, name in enumerate(names[: _plane(stretch.sought)])]


def _asked(stretch: Stretch, names: tuple[str, ...]) -> list[Watched]:
    """The same for what else is asked for: inner free parameters and observables."""
    return [Watched("extremum", _slope(n), "", n, smooth=_own_slope(n)) for n in stretch.options.extrema
            if n not in names[: _plane(stretch.sought)]]  # fmt: skip


def _beside_cusp(test: Test) -> Test:
    def ratio(frame: LocusFrame) -> float:
        quadratic = frame.tests.values["cusp"]
        return test(frame) / float(np.copysign(max(abs(quadratic), 1e-300), quadratic))

    return ratio


def with_sure_signs(stretch: Stretch, names: tuple[str, ...]) -> Stretch:
    """The stretch, its right end evaluated once more where a test function changes sign by so little that the distance
    of that frame from the iterate at which it was evaluated matters.

    The sign at a frame, once it is the left end of the next stretch, is never evaluated again: whatever it is, each
    event is then seen on one stretch.
    """
    right = stretch.right
    every = (*_candidates(stretch), *_turns(stretch, names), *_asked(stretch, names))
    near = [w for w in every if abs(w.test(right)) < 100 * right.noise]
    if not any(w.changes(stretch) for w in near):
        return stretch
    found = correct(stretch.sought, right, right.x, right.tangent, stretch.options, exact=True)
    if found is None:
        return stretch
    again = replace(found[0].after(stretch.left, stretch.step), iterations=right.iterations)
    return replace(stretch, right=again)


def smooth_tests(stretch: Stretch) -> list[Test]:
    """What is watched besides turns, as functions whose values on one mesh can be compared with those on another."""
    return [w.smooth or w.test for w in _candidates(stretch)]


def _meeting(stretch: Stretch, turns: int) -> Watched | None:
    """What a locus of folds meets where both parameters lose their effect on the kernel, and it on them again.

    At a pitchfork that changes between super- and subcritical both parameters turn, and the quadratic term has a
    triple zero, which is no good for locating it.
    """
    left, right = (np.array(frame.tests.shares) for frame in _ends(stretch))
    if left @ right >= 0:
        return None
    i = int(np.argmax(np.abs(left - right)))
    kind, what, on_points = "coalescence", "the fold passes through a branch point", "quadratic"
    if turns == 2:
        kind, what = "criticality", "the pitchfork here changes between super- and subcritical"
        on_points = "criticality"
    return Watched(kind, lambda f: f.tests.shares[i], what, singular=True, on_points=on_points)


def _ends(stretch: Stretch) -> tuple[LocusFrame, LocusFrame]:
    return stretch.left, stretch.right


def _value(name: str) -> Test:
    return lambda frame: frame.tests.values[name]


_CUSP = Watched("cusp", _value("cusp"), "two folds meet")
_QUADRATIC = Watched("coalescence", _value("quadratic"), "a fold of the side branch passes")
_CRITICALITY = Watched("criticality", _value("criticality"), "super- and subcritical change")
_PITCHFORK = Watched("pitchfork", _value("quadratic"), "the branch point is a pitchfork", noise=PITCHFORK)
_TRUNK = Watched("coalescence", _value("trunk"), "the branch that is crossed has a fold")


def _candidates(stretch: Stretch) -> list[Watched]:
    """What is watched on a locus of this kind, besides its turns."""
    zeros = [Watched(f"zero of {name}", _crossing(name, value), f"{name} = {value:g}")
             for name, value in stretch.options.sought]  # fmt: skip
    if stretch.sought.kind == "fold":
        return [_CUSP, _second_kernel("coalescence", "the fold meets a branch point", "trunk"), *zeros]
    if stretch.sought.kind == "branch point":
        other = _second_kernel("crossing", "another branch point at the same solution")
        return [_CRITICALITY if stretch.sought.pitchfork else _QUADRATIC, _TRUNK, other, *zeros]
    if stretch.sought.kind == UNPROTECTED:
        return [_PITCHFORK, _second_kernel("crossing", "another branch point at the same solution"), *zeros]
    return zeros


def _crossing(name: str, value: float) -> Test:
    return lambda frame: frame.beyond(name, value)


def crowded(stretch: Stretch, found: list[Watched]) -> bool:
    """Whether a shorter step should be taken, since two extrema may hide on this one (both may seem so at a cusp)."""
    if _CUSP in found:
        return False
    left, right = _ends(stretch)
    noise = 1e3 * max(left.noise, right.noise, ROUND_OFF)
    for i in range(_plane(stretch.sought)):
        mean = (right.x.scalars[i] - left.x.scalars[i]) / stretch.step
        if dips(left.tangent.scalars[i], right.tangent.scalars[i], mean, noise):
            return True
    for name in stretch.options.extrema:
        mean = (right.value(name) - left.value(name)) / stretch.step / _size(right, name)
        slope = _slope(name)
        if dips(slope(left), slope(right), mean, noise):
            return True
    return False


def locate(stretch: Stretch, what: Watched, names: tuple[str, ...]) -> LocusEvent:
    """The special point, located by root finding on corrected points and told apart by its normal form."""
    test = what.precise(stretch) if what.precise else what.test
    if what.singular:
        found, test = _singular(stretch, what, test)
    else:
        found = (stretch.left, 0.0) if what.begins(stretch) else stretch.root(test)
    status = Status.CONVERGED if found else Status.BRACKETED
    at, fraction = found or (stretch.right, 1.0)
    arclength = stretch.start + fraction * stretch.step
    bracket = (arclength, arclength) if found else (stretch.start, stretch.start + stretch.step)
    solution = at.colloc.solution(at.x, stretch.right.error)
    event = LocusEvent(what.kind, what.parameter, solution, arclength, status, bracket, test(at), what.what)
    if what.kind == "cusp":
        return replace(event, coefficients=cusp_form(at.colloc, at.x, at.border))
    if what.kind == "extremum":
        if what.parameter not in names[: _plane(stretch.sought)]:
            kind = "maximum" if what.test(stretch.left) > 0 else "minimum"
            return replace(event, what=f"a {kind} of {what.parameter} along the locus")
        told = _turn(stretch.sought, at, names.index(what.parameter), what.parameter)
        return replace(event, what=told) if isinstance(told, str) else replace(event, what=told.value, effect=told)
    return event


def _singular(stretch: Stretch, what: Watched, test: Test) -> tuple[tuple[LocusFrame, float] | None, Test]:
    """Frame and fraction of a special point at which the equations of the locus are singular; and its test function.

    None when it is known neither from branch points that it meets nor from interpolation.
    """
    near = stretch.singular_root(test)
    exact = _on_branch_points(stretch, near.frame, what.on_points) if what.on_points else None
    if exact is not None:
        slack, place = 3e-4 / stretch.step, stretch.position(exact.x)
        if what.kind == "criticality" or near.bracket[0] - slack < place < near.bracket[1] + slack:
            return (exact, near.fraction), _value(what.on_points)
    settled = what.kind != "criticality" and near.error < INTERPOLATED
    return ((near.frame, near.fraction) if settled else None), test


def _on_branch_points(stretch: Stretch, near: LocusFrame, name: str) -> LocusFrame | None:
    """Where a test function vanishes on the locus of branch points that a locus of folds meets close to a frame.

    There its own equations are singular: points near by, from which the place was interpolated, are known to a part of
    what the arithmetic allows, and at a pitchfork that turns subcritical an imperfection e of the discrete problem
    moves it by e^(1/5). Those of the branch points are regular. None when no branch point persists there.
    """
    sought = Sought("branch point", pitchfork=name == "criticality")
    here = frame_at(sought, near.colloc, near.x, stretch.options)
    step = 0.1 * stretch.step
    for _ in range(12):
        ahead = None
        if here is not None:
            ahead = correct(sought, here, here.predict(step), here.tangent, stretch.options, exact=True)
        if here is None or ahead is None or abs(ahead[0].unfolding) > PERSISTS:
            return None
        values = [f.tests.values[name] for f in (here, ahead[0])]
        if abs(step) < LOCATED:
            away = near.colloc.norm(add(ahead[0].x, (-1.0, near.x)))
            return ahead[0] if away < max(0.1 * stretch.step, 0.01) else None
        if values[0] == values[1]:
            return None
        here, step = ahead[0], step * values[1] / (values[0] - values[1])
        if abs(step) > stretch.step:
            return None
    return None


def _turn(sought: Sought, at: LocusFrame, parameter: int, name: str) -> str | Effect:
    """What happens where a locus turns back in one of its parameters.

    On a locus of folds two branches in the other parameter touch: a curve of solutions shrinks to a point (the
    quadratic form on the kernel is definite) or two of them reconnect (it is indefinite).
    """
    if sought.kind == "branch point":
        return "two branch points meet and vanish"
    if sought.kind == UNPROTECTED:  # its quadratic form is degenerate where the third parameter turns, and nowhere else
        meet = "an isola center and a crossing of two branches meet and vanish"
        return meet if parameter == 2 else f"the locus turns back in {name}"
    if sought.kind != "fold":
        return "two points of the branch with this value meet and vanish"
    form, force = fold_quadratic(at.colloc, at.x, at.border, along=1 - parameter, across=parameter)
    low, high = np.linalg.eigvalsh(form)
    if low * high < 0:
        return Effect.TOUCH
    grows = force * (low + high) < 0  # force dp + form(a, a)/2 = 0 has solutions for dp of this sign
    return Effect.APPEARS if grows else Effect.VANISHES


def _second_kernel(kind: str, what: str, on_points: str = "") -> Watched:
    """One more vector in the kernel: the bordered determinant changes sign."""
    return Watched(kind, _sign, what, singular=True, precise=_determinant, smooth=_weakness, on_points=on_points)


def _sign(frame: LocusFrame) -> float:
    return frame.tests.determinant[0]


def _weakness(frame: LocusFrame) -> float:
    return frame.tests.weakness


def _determinant(stretch: Stretch) -> Test:
    """The bordered determinant relative to that at the right end, with the same borders at both."""
    reference = stretch.right.tests.determinant[1]
    left = stretch.left

    def test(frame: LocusFrame) -> float:
        if frame is left:
            local = stretch.sought.local(stretch.right.colloc, left.x, stretch.right.border, left.unfolding)
            sign, log_det = local.measure(None).determinant if local else left.tests.determinant
        else:
            sign, log_det = frame.tests.determinant
        return sign * float(np.exp(min(log_det - reference, 50.0)))

    return test


def _component(i: int) -> Test:
    return lambda frame: float(frame.tangent.scalars[i])


def _slope(name: str) -> Test:
    """Derivative of an observable or inner parameter along the locus, in units of its gradient."""
    return lambda frame: slope_along(frame.colloc, name, frame.x, frame.tangent) / _size(frame, name)


def _own_slope(name: str) -> Test:
    """The same in units of its own: smooth where the gradient vanishes."""
    return lambda frame: slope_along(frame.colloc, name, frame.x, frame.tangent)


def _size(frame: LocusFrame, name: str) -> float:
    return size_of(frame.colloc.observable_row(name, frame.x)[1], frame.colloc) or 1.0
