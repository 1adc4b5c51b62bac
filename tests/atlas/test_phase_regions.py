"""States of faces from slices, and the warnings when slices contradict each other or the loci: with made-up slices."""

from types import SimpleNamespace

import numpy as np
import pytest

from rodatlas.atlas.loci.events import PlaneEvent
from rodatlas.atlas.phase.arrangement import cut_plane
from rodatlas.atlas.phase.lines import Line
from rodatlas.atlas.phase.regions import Crossing, assign, check_crossings, crossings, deduced

FRAME = SimpleNamespace(  # what is asked of settings
    region=np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 1.0], [0.0, 1.0], [0.0, 0.0]]), second_scale=100.0,
    units=(1.0, 1.0, 1.0), along="shear", second="angle", nomenclature=SimpleNamespace(in_plane=lambda name: name),
)  # fmt: skip
HALF = Line("4", "pitchfork", np.array([[0.0, 0.5], [10.0, 0.5]]))


def state(name, low, high, kinds=("range", "fold")):
    ends = [SimpleNamespace(kind=k, value=x, text=k) for k, x in zip(kinds, (low, high), strict=True)]
    return SimpleNamespace(name=name, span=(low, high), low=ends[0], high=ends[1])


def made_up(angle, *states):
    settings = SimpleNamespace(setting={"angle": angle}, place_text=f"angle {angle:g} deg")
    return SimpleNamespace(settings=settings, states=states)


def usual(angle, at=0.5):
    """U below a pitchfork, a pair above it, W everywhere."""
    return made_up(
        angle, state("U", 0.0, at, ("range", "pitchfork")), state("US+-", at, 1.0, ("pitchfork", "range")),
        state("W", 0.0, 1.0, ("range", "range")),
    )  # fmt: skip


def event(angle, *labels):
    return PlaneEvent("criticality", "", angle, 0.5, 0.0, (), labels, False, "converged", True, "")


def test_faces_get_the_states_of_slices():
    faces, warnings = assign(cut_plane([HALF], FRAME), [usual(3.0), usual(7.0)], FRAME)
    assert warnings == []
    assert [f.states for f in faces] == [("U", "W"), ("US+-", "W")]
    assert [f.count for f in faces] == [2, 3]
    assert faces[0].samples == ((3.0, 0.25), (7.0, 0.25))


def test_a_state_that_ends_inside_a_face_is_reported():
    _, warnings = assign(cut_plane([HALF], FRAME), [made_up(5.0, state("w", 0.0, 0.7))], FRAME)
    assert warnings == ["slice at angle 5 deg: w ends at shear 0.7 (fold), inside a face"]


def test_slices_that_contradict_each_other_are_reported_and_not_decided():
    faces, warnings = assign(cut_plane([HALF], FRAME), [usual(3.0), made_up(7.0, state("U", 0.0, 0.5))], FRAME)
    assert [f.states for f in faces] == [None, None]
    assert len(warnings) == 2
    assert all(w.startswith("face with different stable states: (3, ") for w in warnings)


def test_equal_names_count_twice():
    two = made_up(5.0, state("uUui", 0.0, 1.0, ("range",) * 2), state("uUui", 0.0, 1.0, ("range",) * 2))
    faces, _ = assign(cut_plane([], FRAME), [two], FRAME)
    assert faces[0].states == ("uUui", "uUui")


def test_what_changes_across_a_line():
    (found,) = crossings(cut_plane([HALF], FRAME), [HALF], [usual(3.0)], FRAME)
    assert (found.label, found.lost, found.gained) == ("4", ("U",), ("US+-",))
    assert found.value == pytest.approx(0.5)


@pytest.mark.parametrize(("kind", "lost", "gained", "allowed"), [
    ("fold", (), ("w",), True),
    ("fold", ("US+-",), (), True),
    ("fold", ("U",), ("w",), False),
    ("pitchfork", ("U",), ("US+-",), True),
    ("pitchfork", ("U",), (), True),
    ("pitchfork", (), (), True),
    ("pitchfork", (), ("US+-",), False),
    ("pitchfork", (), ("U", "US+-"), False),
    ("pitchfork", ("U", "W"), (), False),
    ("branch point", ("U",), (), False),
    ("smooth", ("U",), ("w",), True),
    ("smooth", ("U",), (), False),
])  # fmt: skip
def test_what_a_line_can_do(kind, lost, gained, allowed):
    crossing = Crossing("4", kind, 5.0, 0.5, lost, gained)
    assert crossing.allowed is allowed
    assert bool(check_crossings([crossing], [])) is not allowed


def test_a_line_that_changes_its_effect_without_a_special_point_is_reported():
    along = [Crossing("4", "pitchfork", 5.0, 0.5, ("U",), ("US+-",)), Crossing("4", "pitchfork", 8.0, 0.5, ("U",), ())]
    assert check_crossings(along, [event(6.0, "4")]) == []
    for elsewhere in ([], [event(6.0, "9")], [event(9.0, "4")]):
        (warning,) = check_crossings(along, elsewhere)
        assert warning.startswith("without a special point between")


def test_a_thin_face_follows_from_its_neighbor_across_an_idle_line_only():
    """Between the pitchfork and a line that bounds nothing; across the pitchfork nothing follows."""
    idle = Line("8", "pitchfork", np.array([[0.0, 0.5 + 3e-5], [10.0, 0.5 + 3e-5]]))
    far = Line("8", "pitchfork", np.array([[0.0, 0.8], [10.0, 0.8]]))
    rings = cut_plane([HALF, idle], FRAME)
    faces, _ = assign(rings, [usual(3.0)], FRAME)
    assert [f.states for f in faces] == [("U", "W"), None, ("US+-", "W")]
    seen = crossings(cut_plane([HALF, far], FRAME), [HALF, far], [usual(3.0)], FRAME)
    assert deduced(faces, [HALF, idle], seen, [], FRAME)[1].states == ("US+-", "W")
    assert deduced(faces, [HALF, idle], [], [], FRAME)[1].states is None
    busy = [c for c in seen if c.label == "4"]
    assert deduced(faces, [HALF, idle], busy, [], FRAME)[1].states is None
