r"""Continuous symmetries of a boundary value problem, declared by their generators and checked when it is built.

A one-parameter group moves every solution along a curve of solutions, its orbit. The generator is the velocity,

.. math:: \left.\frac{d}{d\alpha}\right|_0 (g_\alpha u)(s) = \xi(s, u, p) + \sigma u'(s), \qquad
          \left.\frac{d}{d\alpha}\right|_0 g_\alpha p = \pi(p),

with :math:`\sigma = 1` where the group shifts s as well. It maps solutions of :math:`u' = f(s, u, p)` to solutions when

.. math:: \xi_s + \xi_u f + \sigma f_s = f_u \xi + f_p \pi

(Olver 1993, Applications of Lie Groups to Differential Equations, section 2.3). All is tested and computed on the
reference interval, where s is a function of the coordinate x and of places, du/dx = F, and :math:`\sigma` is the rate
dx/ds. Parameters are measured there as they are followed, some in their logarithm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rodatlas.continuation.checks import check_flag, check_type, shown
from rodatlas.continuation.problem.symmetry import (
    TOLERANCE,
    NotRespected,
    Samples,
    Symmetry,
    checked,
    differences,
    is_combination,
)
from rodatlas.continuation.problem.traced import by_place
from rodatlas.continuation.problem.tracing import Named, Tracer, function_of, numpy_semantics

if TYPE_CHECKING:
    from rodatlas.continuation.problem.bvp import BVP


@dataclass(frozen=True, eq=False)
class ContinuousSymmetry:
    r"""Declaration of one continuous symmetry.

    Parameters
    ----------
    name : how it is called.
    generator : `generator(s, u, p)` returns the velocities of the unknowns, as a sequence in their order or as a
        mapping in which those that do not move are left out. It is written as a right-hand side is.
    shift : whether s is shifted too, at unit velocity: periodic ends and equations without s, and no breakpoints or
        inner points, which would be shifted too. With no generator the shift is all.
    parameters : `parameters(p)` returns a mapping of names to the velocities of parameters that move along, such as the
        components of an unknown force. They have to be free on every branch, and never the first free one; the ends of
        the interval and places inside it must not depend on them.

    Examples
    --------
    Waves :math:`A = x + iy` that may be turned in the complex plane, and shifted:

    >>> turn = ContinuousSymmetry("turn", lambda s, u, p: {"x": -u.y, "y": u.x, "xs": -u.ys, "ys": u.xs})
    >>> shift = ContinuousSymmetry("shift", shift=True)
    """

    name: str
    generator: Callable[[Any, Any, Any], Any] | None = None
    shift: bool = False
    parameters: Callable[[Any], Mapping[str, Any]] | None = None

    def __post_init__(self) -> None:
        check_type("symmetries", self.name, str, "a name")
        check_flag(f"symmetries: '{self.name}': shift", self.shift)
        for field in ("generator", "parameters"):
            value = getattr(self, field)
            if value is not None and not callable(value):
                raise ValueError(f"symmetries: '{self.name}': expected a function as {field}, got {shown(value)}")
        if self.generator is None and not self.shift:
            raise ValueError(f"symmetries: '{self.name}': expected a generator, or shift=True, got neither")


@dataclass(frozen=True, eq=False)
class Generator:
    """A continuous symmetry bound to a problem.

    Attributes
    ----------
    velocity : CasADi function (x, u, p) -> (n,), the shift included, since du/ds = f along a solution.
    on_parameters : CasADi function p -> (np,).

    Here x is the coordinate of the reference interval, and p as parameters are followed. A problem made of this one
    may have more parameters behind these, which stay.
    """

    name: str
    velocity: Any
    on_parameters: Any

    def __repr__(self) -> str:
        return f"Generator({self.name})"


def generators(bvp: BVP, declared: Sequence[ContinuousSymmetry]) -> tuple[Generator, ...]:
    """The continuous symmetries of a problem, each tested at random points.

    Raises
    ------
    ValueError
        naming the symmetry and what it does not respect: an equation, the boundary conditions, or the integrals.
    """
    if not declared:
        return ()
    with np.errstate(all="ignore"):
        samples = Samples(bvp, ())
        return tuple(_checked(bvp, samples, symmetry) for symmetry in declared)


def is_symmetry(bvp: BVP, guess: Symmetry | ContinuousSymmetry) -> bool:
    """Whether a guess is a symmetry of the problem; ValueError where that cannot be told.

    >>> is_symmetry(bvp, ContinuousSymmetry("shift", shift=True))
    True
    """
    if not hasattr(bvp, "parameter_names"):  # its class stands above this module
        raise ValueError(f"bvp: expected a BVP, got {shown(bvp)}")
    check_type("guess", guess, (Symmetry, ContinuousSymmetry), "a Symmetry or a ContinuousSymmetry")
    try:
        if isinstance(guess, Symmetry):
            checked(bvp, [guess])
        else:
            generators(bvp, [guess])
    except NotRespected:
        return False
    return True


@dataclass(frozen=True)
class _Changes:
    """CasADi functions: what a generator changes in the field, the ends, and the densities, to first order."""

    field: Any
    ends: Any
    densities: Any


def _checked(bvp: BVP, samples: Samples, symmetry: ContinuousSymmetry) -> Generator:
    """The generator, after its effect on equations, ends and integrals was found to vanish to first order."""
    name, (generator, changes) = symmetry.name, _traced(bvp, symmetry)
    change = samples.value(changes.field, samples.s, samples.u, samples.at)
    wrong = differences(name, "the right-hand side", samples.f, samples.f + change)
    if wrong.any():
        names = ", ".join(unknown for unknown, bad in zip(bvp.unknowns, wrong, strict=True) if bad)
        samples.refuse(name, f"the equation for {names}")
    (left, right), p = samples.constrained([samples.left, samples.right], samples.p, True)
    if len(p) < 3:
        raise ValueError(f"symmetries: '{name}' cannot be checked: no random states meet the boundary conditions")
    ends = np.hstack([left, right])
    size = 1.0 + np.abs(ends).max(axis=1, keepdims=True)
    change = samples.value(changes.ends, ends, p)
    if (bad := ~(np.abs(change[:, : bvp.n_boundary]) < 1e3 * TOLERANCE * size).all(axis=0)).any():
        samples.refuse(name, f"the boundary conditions (residuals {', '.join(map(str, np.flatnonzero(bad)))})")
    if k := bvp.n_integral:
        g = samples.value(bvp.traced.densities, samples.s, samples.u, samples.at)[:, :k]
        inside = samples.value(changes.densities, samples.s, samples.u, samples.at)
        flows = np.abs(change[:, bvp.n_boundary :]) < 1e3 * TOLERANCE * size
        if not (flows.all() and is_combination(name, "the integral conditions", g, inside)):
            samples.refuse(name, "the integral conditions")
    return generator


def _traced(bvp: BVP, symmetry: ContinuousSymmetry) -> tuple[Generator, _Changes]:
    """Velocity, and changes to first order, as CasADi functions.

    Behind the changes of the boundary conditions stand those of the integrals that a shift makes at the ends.
    """
    import casadi as ca

    s, u, p = ca.SX.sym("x"), ca.SX.sym("u", bvp.size), ca.SX.sym("p", len(bvp.parameters))
    both, k = ca.SX.sym("both", 2 * bvp.size), bvp.n_integral
    xi, pi, sigma = _generator(bvp, symmetry, ca, (s, u, p))
    f, g = bvp.traced.field(s, u, p)[0], bvp.traced.densities(s, u, p)[0][:k]
    velocity = function_of(ca, "velocity", [s, u, p], [ca.densify(xi + sigma * f)])

    def along(expression: Any, *moves: tuple[Any, Any]) -> Any:
        """First-order change of an expression when each symbol moves with a velocity."""
        terms = [ca.jtimes(expression, x, v) for x, v in moves if x.numel() and expression.numel()]
        return sum(terms, ca.SX(expression.numel(), 1))

    field = along(xi, (s, ca.SX(1)), (u, f)) + sigma * along(f, (s, ca.SX(1))) - along(f, (u, xi), (p, pi))
    ends = (both[: bvp.size], both[bvp.size :])
    moved = ca.vertcat(velocity(0, ends[0], p), velocity(1, ends[1], p))
    b = along(bvp.traced.ends(both, p)[0][: bvp.n_boundary], (both, moved), (p, pi))
    flow = sigma * (bvp.traced.densities(1, ends[1], p)[0][:k] - bvp.traced.densities(0, ends[0], p)[0][:k])
    densities = along(g, (u, xi), (p, pi)) - sigma * along(g, (s, ca.SX(1)))
    return (
        Generator(symmetry.name, velocity, function_of(ca, "on_parameters", [p], [ca.densify(pi)])),
        _Changes(
            ca.Function("field_change", [s, u, p], [ca.densify(field)]),
            ca.Function("ends_change", [both, p], [ca.densify(ca.vertcat(b, flow))]),
            ca.Function("densities_change", [s, u, p], [ca.densify(densities)]),
        ),
    )


def _generator(bvp: BVP, symmetry: ContinuousSymmetry, ca: Any, symbols: tuple[Any, Any, Any]) -> tuple[Any, Any, Any]:
    """Velocities (n,) of the unknowns without the shift, (np,) of the parameters as followed, and that of x."""
    where, (x, u, p) = f"symmetries: '{symmetry.name}'", symbols
    places, layout = bvp.traced.places(p), bvp.layout
    is_log = [name in bvp.log for name in bvp.parameters]
    values = [ca.exp(q) if log else q for q, log in zip(ca.vertsplit(p), is_log, strict=True)]
    named = Named(bvp.parameter_names, values)
    starts = [
        (places[i], places[j], a, b) for i, j, a, b in
        zip(layout.places[:-1].tolist(), layout.places[1:].tolist(), layout.knots[:-1], layout.knots[1:], strict=True)
    ]  # fmt: skip
    s = by_place(ca, x, layout.knots[:-1], [one + (x - a) * ((two - one) / (b - a)) for one, two, a, b in starts])
    with numpy_semantics(ca):
        inside = Tracer(ca, symbols, (s, Named(bvp.unknowns, ca.vertsplit(u)), named))
        xi = inside.column(_filled(symmetry.generator, where, bvp.unknowns), where, bvp.unknowns)
        alone = Tracer(ca, (p,), (named,))
        moved = _filled(symmetry.parameters, where, bvp.parameter_names)
        pi = alone.column(moved, where, bvp.parameter_names) if bvp.parameters else ca.SX(0, 1)
    for i in np.flatnonzero(is_log):
        pi[i] /= values[i]
    if bvp.parameters and not ca.jtimes(places, p, pi).is_zero():
        raise ValueError(f"{where}: expected parameters on which no end or place inside the interval depends")
    if symmetry.shift and len(layout.weights) > 1:
        raise ValueError(f"{where}: expected no breakpoints, inner points or values at places, which it would shift")
    return xi, pi, (1 / (places[-1] - places[0]) if symmetry.shift else ca.SX(0))


def _filled(function: Callable[..., Any] | None, where: str, names: Sequence[str]) -> Callable[..., Any]:
    """The function with zeros for the names that its mapping leaves out; all zeros where there is none."""

    def filled(*arguments: Any) -> Any:
        values = function(*arguments) if function is not None else {}
        if not isinstance(values, Mapping):
            return values
        if strangers := [name for name in values if name not in names]:
            raise ValueError(f"{where}: expected some of {', '.join(names)}, got '{strangers[0]}'")
        return [values.get(name, 0.0) for name in names]

    return filled
