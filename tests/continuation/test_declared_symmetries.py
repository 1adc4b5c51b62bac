"""Declared symmetries: checked, acting on solutions, found in solutions and kernels, and used to stay symmetric."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from bvp_problems import EULER_LOADS, algebraic, constant

from rodatlas.continuation import BVP, MeshControl, Solution, TraceOptions, integral_of, solve, switch, trace
from rodatlas.continuation.discrete.collocation import Collocation, Scale
from rodatlas.continuation.discrete.newton import fixed, newton
from rodatlas.continuation.discrete.vectors import add, scaled
from rodatlas.continuation.linear.matrix import Columns
from rodatlas.continuation.problem.symmetry import Symmetry
from rodatlas.continuation.symmetric.isotropy import (
    broken,
    broken_at,
    generated,
    image,
    is_symmetric_mesh,
    isotropy,
    parity,
    projected,
    restrict,
    subspace,
    symmetric_mesh,
)

FLIP = Symmetry("flip", {"x": -1})


@lru_cache
def pitchfork() -> BVP:
    """x (lam - x^2) = 0."""
    return algebraic(lambda u, p: [u.x * (p.lam - u.x**2)], symmetries=[FLIP])


@lru_cache
def square() -> BVP:
    """x (lam - x^2 - 2 y^2) = y (lam - y^2 - 2 x^2) = 0: the symmetries of a square."""
    turn, mirror = Symmetry("turn", {"x": "-y", "y": "x"}), Symmetry("mirror", {"y": -1})
    return algebraic(
        lambda u, p: [u.x * (p.lam - u.x**2 - 2 * u.y**2), u.y * (p.lam - u.y**2 - 2 * u.x**2)], ("x", "y"),
        symmetries=[turn, mirror],
    )  # fmt: skip


@lru_cache
def elastica() -> BVP:
    """Planar clamped-clamped elastica under thrust P, with its mirror about the chord and its reversal."""
    return BVP(
        lambda s, u, p: [np.sin(u.theta), u.k, -p.P * np.sin(u.theta) + p.V * np.cos(u.theta)],
        lambda left, right, p: [left.y, left.theta, right.y, right.theta],
        unknowns=("y", "theta", "k"), parameters={"P": 0.0, "V": 0.0},
        observables={"area": integral_of(lambda s, u, p: u.y)}, scales={"P": 100.0, "V": 100.0, "k": 10.0},
        symmetries=[
            Symmetry("mirror", {"y": -1, "theta": -1, "k": -1}, {"V": -1}),
            Symmetry("reversal", {"theta": -1}, {"V": -1}, reverse=True),
        ],
        name="elastica",
    )  # fmt: skip


@lru_cache
def phases() -> BVP:
    """eps^2 u'' = mu - u + u^3, u'(0) = u'(1) = 0 with mean m."""
    return BVP(
        lambda s, u, p: [u.v / p.eps, (p.mu - u.u + u.u**3) / p.eps],
        lambda left, right, p: [left.v, right.v],
        lambda s, u, p: u.u - p.m,
        unknowns=("u", "v"), parameters={"m": 0.0, "mu": 0.0, "eps": 0.1}, name="phase separation",
        symmetries=[
            Symmetry("swap", {"u": -1, "v": -1}, {"m": -1, "mu": -1}), Symmetry("reversal", {"v": -1}, reverse=True),
        ],
    )  # fmt: skip


@lru_cache
def buckled(mode: int) -> Solution:
    """Elastica on the branch of one buckling mode, P somewhat above its Euler load, V free."""
    straight = Solution.from_function(lambda s: np.zeros((len(s), 3)), ("y", "theta", "k"), {"P": 30.0, "V": 0.0})
    limit = EULER_LOADS[mode - 1] + 5.0
    options = TraceOptions(bounds={"P": (20.0, limit)})
    line = trace(elastica(), straight, ("P", "V"), options, both=False)
    special = line.of_kind("branch point")[mode - 1]
    branch = switch(elastica(), special, ("P", "V"), replace(options, bounds={"P": (20.0, limit + 5.0)}, max_points=12))
    return branch.points[-1].solution


def discrete(bvp: BVP, solution: Solution, free: tuple[str, ...]) -> tuple[Collocation, Columns]:
    """The solution's own discretisation and its state."""
    index = [bvp.parameter_index(name) for name in free]
    colloc = Collocation(
        bvp, solution.mesh, solution.points, solution.parameters, index, Scale.of(bvp, solution)
    )  # fmt: skip
    return colloc, colloc.state(solution)


# -- declarations -----------------------------------------------------------------------------------------------------


def test_a_declaration_is_numbers_expressions_or_matrices() -> None:
    names, parameters = ("x", "y"), ("a", "b")
    action = Symmetry("any", {"x": "a/2 - y + 2*(b - 1)", "y": "2*b - x + a/2 - 2"}).bind(names, parameters)
    u, p = np.array([3.0, 5.0]), np.array([0.5, 0.25])
    assert np.allclose(action.unknowns(u, p), [-1.25 - 5.0, -1.25 - 3.0])
    assert action.order == 2
    action = Symmetry("other", {"x": -1}, {"b": "pi - b"}).bind(names, parameters)
    assert np.allclose(action.unknowns(u, p), [-3.0, 5.0])
    assert np.allclose(action.parameters(p), [0.5, np.pi - 0.25])
    turn = Symmetry("turn", np.array([[0.0, -1.0], [1.0, 0.0]])).bind(names, parameters)
    assert turn.order == 4
    assert (turn @ turn).order == 2
    assert "order 4" in repr(turn)


@pytest.mark.parametrize(
    ("symmetry", "words"),
    [
        (Symmetry("bad", {"w": -1}), "among x, y, got 'w'"),
        (Symmetry("bad", {"x": "x*y"}), "affine expression of x, y, lam, got"),
        (Symmetry("bad", {"x": "sin(y)"}), "affine expression"),
        (Symmetry("bad", {"x": "-"}), "affine expression"),
        (Symmetry("bad", {}, {"lam": "x"}), "affine expression of lam"),
        (Symmetry("bad", {"x": 2}), "after at most"),
        (Symmetry("bad", np.eye(3)), r"shape \(2, 2\), got \(3, 3\)"),
        (Symmetry("a * b"), "without '\\*'"),
    ],
)
def test_a_declaration_that_makes_no_sense_is_refused(symmetry: Symmetry, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        algebraic(lambda u, p: [u.x, u.y], ("x", "y"), symmetries=[symmetry])


def test_names_are_distinct() -> None:
    with pytest.raises(ValueError, match="distinct"):
        algebraic(lambda u, p: [u.x], symmetries=[FLIP, FLIP])


def test_a_problem_without_the_symmetry_is_refused() -> None:
    with pytest.raises(ValueError, match="'flip' does not respect the boundary conditions \\(residuals 0\\)"):
        algebraic(lambda u, p: [u.x * (p.lam - u.x**2) + 0.01], symmetries=[FLIP])
    with pytest.raises(ValueError, match="'even' does not respect the equation for v"):
        BVP(
            lambda s, u, p: [u.v, -p.lam * np.exp(u.u)], lambda left, right, p: [left.u, right.u],
            unknowns=("u", "v"), parameters={"lam": 1.0}, symmetries=[Symmetry("even", {"u": -1, "v": -1})],
        )  # fmt: skip
    with pytest.raises(ValueError, match="'reversal' does not respect the boundary conditions"):
        BVP(
            lambda s, u, p: [u.v, -p.lam * u.u], lambda left, right, p: [left.u, right.v],
            unknowns=("u", "v"), parameters={"lam": 1.0}, symmetries=[Symmetry("reversal", {"v": -1}, reverse=True)],
        )  # fmt: skip
    with pytest.raises(ValueError, match="'swap' does not respect the integral conditions"):
        BVP(
            lambda s, u, p: [u.v, p.mu - u.u + u.u**3], lambda left, right, p: [left.v, right.v],
            lambda s, u, p: u.u - p.m, unknowns=("u", "v"), parameters={"m": 0.0, "mu": 0.0},
            symmetries=[Symmetry("swap", {"u": -1, "v": -1}, {"mu": -1})],
        )  # fmt: skip


def test_what_cannot_be_evaluated_cannot_be_checked() -> None:
    with pytest.raises(ValueError, match="cannot be checked"):
        BVP(
            lambda s, u, p: [np.sqrt(-1.0 - u.x**2)], lambda left, right, p: [left.x - p.lam],
            unknowns=("x",), parameters={"lam": 0.0}, symmetries=[FLIP],
        )  # fmt: skip


def test_conditions_may_be_nonlinear_and_periodic() -> None:
    """Residuals whose images are no constant combinations, but vanish together; and a time-reversible orbit."""

    def damped(shift):
        return BVP(
            lambda s, u, p: [u.v, -p.lam * u.u],
            lambda left, right, p: [left.u * (1 + p.c + left.v**2), (right.u - shift) * np.exp(p.c * right.v)],
            unknowns=("u", "v"), parameters={"lam": 1.0, "c": 0.3},
            symmetries=[Symmetry("reversal", {"v": -1}, reverse=True)],
        )  # fmt: skip

    assert list(damped(0.0).symmetries) == ["reversal"]
    with pytest.raises(ValueError, match="'reversal' does not respect the boundary conditions"):
        damped(0.1)
    orbit = BVP(
        lambda s, u, p: [p.T * u.v, p.T * (p.mu * (1 - u.x**2) * u.v - u.x)],
        lambda left, right, p: [left.x - right.x, left.v - right.v],
        lambda s, u, p: u.x * np.cos(2 * np.pi * s),
        unknowns=("x", "v"), parameters={"mu": 0.5, "T": 6.4},
        symmetries=[Symmetry("half", {"x": -1, "v": -1}), Symmetry("time", {"v": -1}, {"mu": -1}, reverse=True)],
    )  # fmt: skip
    assert list(orbit.symmetries) == ["half", "time"]


def test_coupled_plates_have_both_symmetries() -> None:
    """w'' = (f - lam) w, f'' = -w^2/2 (the von Karman coupling): w -> -w, and s -> 1 - s."""
    bvp = BVP(
        lambda s, u, p: [u.w1, (u.f - p.lam) * u.w, u.f1, -(u.w**2) / 2],
        lambda left, right, p: [left.w, right.w, left.f, right.f],
        unknowns=("w", "w1", "f", "f1"), parameters={"lam": 1.0},
        symmetries=[Symmetry("up-down", {"w": -1, "w1": -1}), Symmetry("reversal", {"w1": -1, "f1": -1}, reverse=True)],
    )  # fmt: skip
    assert list(bvp.symmetries) == ["up-down", "reversal"]
    line = trace(bvp, constant(bvp, lam=5.0), ("lam",), TraceOptions(bounds={"lam": (5.0, 45.0)}))
    lost = [broken_at(bvp, special) for special in line.special]  # lam = pi^2 and 4 pi^2
    assert lost == [("up-down",), ("up-down", "reversal")]
    assert broken_at(bvp, line.special[1], among=["up-down * reversal"]) == ()
    assert broken_at(bvp, replace(line.special[0], directions=())) == ()


def test_boundary_conditions_may_need_what_holds_along_solutions() -> None:
    """A turning unit vector (c, s): the right end states its direction, its length follows from the left end."""

    def build(symmetries, identities=None):
        return BVP(
            lambda s, u, p: [-p.w * u.s, p.w * u.c, 2 * u.c**2 - 1],
            lambda left, right, p: [left.c - 1, left.s, right.s - p.w * right.c, left.x],
            unknowns=("c", "s", "x"), parameters={"w": 1.0, "v": 0.0}, symmetries=symmetries, identities=identities,
        )  # fmt: skip

    def unit(u, p):
        return u.c**2 + u.s**2 - 1

    # 2 c^2 - 1 = 1 - 2 s^2 on unit vectors only
    quarter = Symmetry("quarter", {"c": "-s", "s": "c", "x": "-x"}, gauge=True)
    build([quarter], unit)
    with pytest.raises(ValueError, match="'quarter' does not respect the equation for x"):
        build([quarter])


def test_images_may_need_a_gauge() -> None:
    """u' = 0, u(0) = 1 and u^2 = 1: reversed, u(1) = -1 starts at -1, which is the same state as 1."""

    def build(*gauges):
        return BVP(
            lambda s, u, p: [0.0 * u.u, p.a * u.u**2], lambda left, right, p: [left.u - 1, left.w + right.w],
            unknowns=("u", "w"), parameters={"a": 0.0}, identities=lambda u, p: u.u**2 - 1,
            symmetries=[Symmetry("reversal", {}, {"a": -1}, reverse=True), *gauges],
        )  # fmt: skip

    with pytest.raises(ValueError, match=r"'reversal' does not respect the boundary conditions \(residuals 0\)"):
        build()
    bvp = build(Symmetry("sign", {"u": -1}, gauge=True))
    assert list(bvp.symmetries) == ["reversal"]
    assert [g.name for g in bvp.gauges] == ["sign"]
    state = Solution.from_function(lambda s: np.column_stack([1 + 0 * s, 2 * s - 1]), ("u", "w"), {"a": 2.0})
    turned = replace(state, values=state.values * [[-1.0, 1.0]], stages=state.stages * [-1.0, 1.0])
    for one in (state, turned):  # the image is put where the boundary conditions hold
        assert np.allclose(image(bvp, "reversal", one)["u"], 1.0)


# -- images and isotropy ----------------------------------------------------------------------------------------------


def test_isotropy_of_algebraic_solutions() -> None:
    bvp = pitchfork()
    assert isotropy(bvp, constant(bvp, lam=1.0)) == ("flip",)
    one = constant(bvp, [1.0], lam=1.0)
    assert isotropy(bvp, one) == ()
    assert np.allclose(image(bvp, "flip", one).values, -1.0)


def test_isotropy_under_the_symmetries_of_a_square() -> None:
    bvp = square()
    group = generated(list(bvp.symmetries.values()), 4)
    assert len(group) == 8
    assert sorted(g.order for g in group) == [1, 2, 2, 2, 2, 2, 4, 4]
    every = ["turn", "turn * turn", "mirror", "turn * mirror", "mirror * turn", "turn * turn * mirror"]
    assert isotropy(bvp, constant(bvp, lam=1.0), among=every) == tuple(every)
    assert isotropy(bvp, constant(bvp, [1.0, 0.0], lam=1.0), among=every) == ("mirror",)
    r = np.sqrt(1 / 3)
    assert isotropy(bvp, constant(bvp, [r, r], lam=1.0), among=every) == ("turn * mirror",)
    assert isotropy(bvp, constant(bvp, [r, -r], lam=1.0), among=every) == ("mirror * turn",)
    assert isotropy(bvp, constant(bvp, [0.3, 0.1], lam=1.0), among=every) == ()
    with pytest.raises(ValueError, match="expected one of turn, mirror, got 'spin'"):
        isotropy(bvp, constant(bvp), among=["spin"])


@pytest.mark.parametrize(("mode", "own", "lost"), [(1, "reversal", "mirror"), (2, "reversal * mirror", "reversal")])
def test_buckled_shapes(mode: int, own: str, lost: str) -> None:
    bvp, bent = elastica(), buckled(mode)
    every = ("mirror", "reversal", "reversal * mirror")
    assert isotropy(bvp, bent, among=every) == (own,)
    other = image(bvp, lost, bent)
    again = solve(bvp, other, ("P", "V"))
    assert np.abs(again.values[[0, -1]] - other.values[[0, -1]]).max() < 1e-6
    assert abs(again["area"] - other["area"]) < 1e-8
    assert abs(other["area"] + bent["area"]) < 1e-7  # zero for mode 2
    assert np.abs(image(bvp, lost, other).values - bent.values).max() < 1e-12


def test_isotropy_does_not_need_a_symmetric_mesh() -> None:
    bvp, bent = elastica(), buckled(1)
    mesh = np.linspace(0.0, 1.0, 41) ** 1.2
    skew = solve(bvp, bent.remesh(mesh), ("P", "V"), TraceOptions(mesh=MeshControl(intervals=(40, 40))))
    assert not is_symmetric_mesh(skew.mesh)
    assert isotropy(bvp, skew) == ("reversal",)
    reversed_mesh = image(bvp, "reversal", skew).mesh
    assert np.allclose(reversed_mesh, 1.0 - skew.mesh[::-1])


def test_symmetries_that_move_parameters() -> None:
    bvp = phases()
    front = Solution.from_function(
        lambda s: np.column_stack([np.tanh((s - 0.5) / 0.14), 0.1 / 0.14 / np.cosh((s - 0.5) / 0.14) ** 2]),
        bvp.unknowns, bvp.parameters, 40,
    )  # fmt: skip
    front = solve(bvp, front, ("m", "mu"))
    every = ("swap", "reversal", "swap * reversal")
    assert isotropy(bvp, front, among=every) == ("swap * reversal",)
    off = solve(bvp, front.with_parameters(m=0.2), ("m", "mu"))
    assert isotropy(bvp, off, among=every) == ()
    swapped = image(bvp, "swap", off)
    assert swapped["m"] == -0.2
    assert swapped["mu"] == -off["mu"]


# -- kernels ----------------------------------------------------------------------------------------------------------


def test_parity_of_kernels() -> None:
    bvp = phases()
    flat = constant(bvp, [-0.9, 0.0], m=-0.9, mu=-0.9 + 0.9**3)
    line = trace(bvp, flat, ("m", "mu"), TraceOptions(bounds={"m": (-0.9, -0.3)}), both=False)
    # 3 m^2 = 1 - (k pi eps)^2: patterns cos(k pi s), odd and even about the middle in turn
    assert [round(1 - 3 * x.solution["m"] ** 2, 6) for x in line.special[:2]] == [
        round((k * np.pi * 0.1) ** 2, 6) for k in (1, 2)
    ]
    found = []
    for special in line.special[:2]:
        colloc, x = discrete(bvp, special.solution, ("m", "mu"))
        along, across = special.directions
        assert parity(colloc, "reversal", x, along) == 1
        found.append((parity(colloc, "reversal", x, across), broken(colloc, x, across)))
        mixed = add(along, (1.0, across))
        assert parity(colloc, "reversal", x, mixed) == (0 if found[-1][0] < 0 else 1)
        with pytest.raises(ValueError, match="leaves the solution unchanged, got 'swap'"):
            parity(colloc, "swap", x, across)
    assert found == [(-1, ("reversal",)), (1, ())]


# -- symmetric subspaces ----------------------------------------------------------------------------------------------


def test_a_symmetric_mesh() -> None:
    mesh = np.linspace(0.0, 1.0, 12) ** 1.5
    even = symmetric_mesh(mesh)
    assert not is_symmetric_mesh(mesh)
    assert is_symmetric_mesh(even)
    assert (np.diff(even) > 0).all()
    assert np.abs(symmetric_mesh(even) - even).max() < 1e-15


def test_projection_on_a_subspace() -> None:
    bvp = square()
    point = constant(bvp, [0.5, 0.3], lam=1.0)
    colloc, x = discrete(bvp, point, ("lam",))
    space = subspace(colloc, ["turn * mirror"], x)
    assert np.allclose(space.state(x).mesh, 0.4)
    assert np.allclose(space(x).scalars, x.scalars)
    assert np.allclose(subspace(colloc, ["turn"], x).state(x).mesh, 0.0)
    assert "turn * mirror" in repr(space)


def test_a_subspace_keeps_the_parameters_of_a_branch() -> None:
    bvp = phases()
    flat = constant(bvp, [0.5, 0.0], m=0.5, mu=0.5 - 0.125)
    colloc, x = discrete(bvp, flat, ("m", "mu"))
    with pytest.raises(ValueError, match="keep the parameter 'm', got swap"):
        subspace(colloc, ["swap"], x)
    colloc, x = discrete(bvp, constant(bvp), ("eps", "mu"))
    assert subspace(colloc, ["swap"], x).scalars.tolist() == [[1.0, 0.0], [0.0, 0.0]]  # mu stays zero with m


def test_projecting_needs_a_symmetric_mesh() -> None:
    bvp = phases()
    flat = constant(bvp, [0.5, 0.0], m=0.5, mu=0.375)
    colloc, x = discrete(bvp, flat.remesh(np.linspace(0, 1, 21) ** 1.3), ("m", "mu"))
    with pytest.raises(ValueError, match="symmetric about 1/2"):
        projected(colloc, "reversal", x)


def test_newton_stays_symmetric_next_to_a_pitchfork() -> None:
    """A disturbance along the kernel at the pitchfork: Newton leaves the flat state, in the subspace it does not."""
    bvp = phases()
    critical = -np.sqrt((1 - (np.pi * 0.1) ** 2) / 3)
    for off in (1e-3, 1e-6, -1e-9):
        m = critical + off
        flat = constant(bvp, [m, 0.0], m=m, mu=m - m**3)
        wave = Solution.from_function(
            lambda s, m=m: np.column_stack([m + 0.05 * np.cos(np.pi * s), -0.005 * np.pi * np.sin(np.pi * s)]),
            bvp.unknowns, {"m": m, "mu": flat["mu"], "eps": 0.1},
        )  # fmt: skip
        colloc, _ = discrete(bvp, flat, ("m", "mu"))
        held = [fixed("m", m)(colloc)]
        x = restrict(colloc, ["reversal"], colloc.state(wave))
        inside = newton(colloc, x, held)
        assert inside.converged
        assert np.abs(inside.state.mesh[:, 0] - m / colloc.scale.unknowns[0]).max() < 1e-9
        assert colloc.norm(add(projected(colloc, "reversal", inside.state), (-1.0, inside.state))) < 1e-15
        colloc.within = None
        outside = newton(colloc, colloc.state(wave), held)
        moved = np.abs(outside.state.mesh[:, 0] - m / colloc.scale.unknowns[0]).max()
        assert not outside.converged or moved > 1e-3


def test_a_curved_branch_is_followed_in_its_subspace() -> None:
    """Newton with projected corrections on the buckled elastica: every state is symmetric to the last digit."""
    bvp, bent = elastica(), buckled(1)
    colloc, x = discrete(bvp, bent.remesh(symmetric_mesh(bent.mesh)), ("P", "V"))
    x = restrict(colloc, ["reversal"], x)
    rng = np.random.default_rng(1)
    for load in np.linspace(bent["P"], bent["P"] + 4.0, 5):
        noise = scaled(Columns(rng.normal(size=x.stage.shape), rng.normal(size=x.mesh.shape), np.zeros(2)), 1e-4)
        result = newton(colloc, projected(colloc, "reversal", add(x, (1.0, noise))), [fixed("P", load)(colloc)])
        assert result.converged
        x = result.state
        space = subspace(colloc, ["reversal"], x)
        assert colloc.norm(add(space.state(x), (-1.0, x))) < 1e-15
        assert abs(x.scalars[1]) < 1e-15  # V, odd under the reversal


def test_newton_finds_the_symmetric_state_from_a_broken_guess() -> None:
    """Within the mirror, the second buckled mode projects to the straight rod, where Newton stays."""
    bvp, bent = elastica(), buckled(2)
    colloc, x = discrete(bvp, bent.remesh(symmetric_mesh(bent.mesh)), ("P", "V"))
    x = restrict(colloc, ["mirror"], x)
    assert np.abs(x.mesh).max() == 0.0
    result = newton(colloc, colloc.state(bent), [fixed("P", bent["P"])(colloc)])  # projects its start, too
    assert result.converged
    assert np.abs(result.state.mesh).max() == 0.0
