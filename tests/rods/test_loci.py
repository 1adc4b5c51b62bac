"""Loci of the band's bifurcations: the events whose angles the paper gives."""

from dataclasses import replace

import numpy as np
import pytest

from rodatlas.continuation import Status, StepControl, TraceOptions, fold_locus_at, follow_locus, trace
from rodatlas.continuation.discrete.collocation import Collocation
from rodatlas.continuation.discrete.vectors import add
from rodatlas.continuation.locus.point import Sought, frame_at
from rodatlas.rods import Ends, rod_problem, state_at
from rodatlas.rods.symmetry import asymmetry

PLANE = ("dD", "psi0")


def branch(family, high=0.75):
    return trace(
        rod_problem(), state_at(Ends(15.0), family), ("dD",), TraceOptions(bounds={"dD": (0.0, high)}), both=False
    )


def locus(special, low, high, **options):
    bounds = {"dD": (0.0, 0.7), "psi0": (np.radians(low), np.radians(high))}
    return follow_locus(rod_problem(), special, PLANE, TraceOptions(bounds=bounds, **options))


def angles(found, kind, parameter=""):
    chosen = [e for e in found.events if e.kind == kind and e.parameter == parameter]
    assert all(e.status is Status.CONVERGED for e in chosen)
    return [float(np.degrees(e.solution["psi0"])) for e in chosen]


@pytest.fixture(scope="module")
def u_branch():
    return branch("U").of_kind("branch point")


def test_pitchforks_4_and_9_are_one_locus(u_branch):
    """4 turns subcritical, then meets 9 and vanishes."""
    found = locus(u_branch[0], 0.0, 60.0)
    (turn,) = angles(found, "criticality")
    (meet,) = angles(found, "extremum", "psi0")
    assert 26.0 < turn < 26.6  # supercritical at 15, subcritical at 27.5 degrees
    assert 28.0 < meet < 28.3
    assert found.column("psi0")[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-9)
    shears = sorted(found.column("dD")[[0, -1]])
    assert shears[0] == pytest.approx(0.359236, abs=1e-6)  # pitchfork 4 at zero angle


def test_pitchforks_11_and_15_annihilate(u_branch):
    found = locus(u_branch[1], 0.0, 60.0)
    assert angles(found, "extremum", "psi0") == pytest.approx([56.293], abs=0.002)
    assert min(found.column("dD")[[0, -1]]) == pytest.approx(0.603240, abs=1e-6)


def test_points_are_converged_where_pitchforks_meet(u_branch):
    """There nothing but the symmetry holds the state along the kernel; one point was 1e-7 off, and said 3e-9."""
    bounds = {"dD": (-0.1, 0.82), "psi0": (0.0, np.radians(80.0))}
    found = follow_locus(
        rod_problem(), u_branch[1], PLANE, TraceOptions(bounds=bounds, step=StepControl(maximum=200.0))
    )
    sought, free = Sought("branch point", pitchfork=True), [rod_problem().parameter_index(name) for name in PLANE]
    for point in found.points:
        colloc = Collocation.at(rod_problem(), point.solution, free, found.scale)
        x = colloc.state(point.solution)
        again = frame_at(sought, colloc, x, TraceOptions())
        assert colloc.norm(add(again.x, (-1.0, x))) < 3e-9


@pytest.fixture(scope="module")
def fold_of_w():
    return branch("third mode").of_kind("fold")[0]


@pytest.fixture(scope="module")
def folds_of_w(fold_of_w):
    return locus(fold_of_w, 0.0, 31.0)


def test_fold_locus_of_w(folds_of_w):
    """Cusp of 6 and 7 at 0.135 degrees; w touches U at 27.71; U-w meets uUui at 30.62."""
    found = folds_of_w
    assert min(angles(found, "cusp")) == pytest.approx(0.135, abs=0.001)
    touching = sorted(angles(found, "extremum", "psi0"))
    assert touching == pytest.approx([27.7098, 30.6200], abs=0.002)
    words = {e.what for e in found.events if e.kind == "extremum" and e.parameter == "psi0"}
    assert words == {"two branches touch: they merge and split"}


def test_fold_locus_12_is_born_where_pitchfork_4_turns_subcritical(u_branch):
    pitchforks = locus(u_branch[0], 0.0, 60.0)
    (event,) = pitchforks.of_kind("criticality")
    bounds = {"dD": (0.0, 0.7), "psi0": (0.0, np.radians(60.0))}
    options = TraceOptions(bounds=bounds, within=("reversal",))  # of U; its side branch US loses that symmetry
    folds = fold_locus_at(rod_problem(), pitchforks, event, options)
    assert {reason.name for reason in folds.ends} == {"CRITICALITY", "RANGE"}
    (end,) = folds.of_kind("criticality")
    assert end.solution["psi0"] == pytest.approx(event.solution["psi0"], abs=1e-5)
    assert end.solution["dD"] == pytest.approx(event.solution["dD"], abs=1e-5)


@pytest.mark.parametrize(("factor", "target"), [(3.0, 2e-2), (0.5, 2e-4)])
def test_events_do_not_depend_on_the_steps(fold_of_w, folds_of_w, factor, target):
    """Seven of them; two cusps lie close to an extremum."""
    base = TraceOptions().step
    step = replace(base, initial=factor * base.initial, maximum=factor * base.maximum, target=target)
    found = locus(fold_of_w, 0.0, 31.0, step=step)
    assert [(e.kind, e.parameter) for e in found.events] == [(e.kind, e.parameter) for e in folds_of_w.events]
    for one, two in zip(found.events, folds_of_w.events, strict=True):
        assert one.status is Status.CONVERGED
        assert [one.solution[name] for name in PLANE] == pytest.approx([two.solution[n] for n in PLANE], abs=1e-6)


def test_a_locus_is_followed_within_a_symmetry(fold_of_w, folds_of_w):
    """The same one, every state symmetric to the last digit also where a pitchfork is passed."""
    inside = locus(fold_of_w, 0.0, 31.0, within=("reversal",))
    assert [(e.kind, e.parameter) for e in inside.events] == [(e.kind, e.parameter) for e in folds_of_w.events]
    for one, two in zip(inside.events, folds_of_w.events, strict=True):
        assert one.solution["psi0"] == pytest.approx(two.solution["psi0"], abs=1e-6)
        assert one.solution["dD"] == pytest.approx(two.solution["dD"], abs=1e-6)
    assert max(asymmetry(p.solution) for p in inside.points) < 1e-13
    assert inside.settings["within"] == ["reversal"]


def test_pitchforks_are_followed_within_the_symmetry_that_they_break(u_branch):
    inside, free = locus(u_branch[0], 0.0, 60.0, within=("reversal",)), locus(u_branch[0], 0.0, 60.0)
    assert inside.pitchfork
    assert angles(inside, "extremum", "psi0") == pytest.approx(angles(free, "extremum", "psi0"), abs=1e-6)
    assert max(asymmetry(p.solution) for p in inside.points) < 1e-13


@pytest.mark.parametrize(("symmetry", "parameter"), [("shear mirror", "dD"), ("angle mirror", "psi0")])
def test_symmetries_that_move_the_plane_are_refused(fold_of_w, symmetry, parameter):
    with pytest.raises(ValueError, match=f"keep the parameter '{parameter}', got {symmetry}"):
        locus(fold_of_w, 0.0, 31.0, within=(symmetry,))
