"""Models, controls and settings: units, limits, which symmetries a setting has, and how a model is known elsewhere."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from arch_model import arch_model, bare_arch_model
from rodatlas.atlas import SliceSettings
from rodatlas.continuation import BVP, solve
from rodatlas.continuation.problem.fingerprint import fingerprint
from rodatlas.model import Control, Model, Quantity, Setting, model_named, register
from rodatlas.model.model import Source
from rodatlas.model.orbit import fixing, group, is_alone, members, own_symmetries, same_state
from rodatlas.paper.model import band
from rodatlas.rods import Ends, state_at

LOAD = Control("load", "q", "q", 0.0)


def test_a_setting_is_a_value():
    one = Setting({"angle": 15, "compression": 0.5})
    assert one == Setting({"compression": 0.5, "angle": 15.0})
    assert {one: 1}[one.replace(angle=15.0)] == 1
    assert one.replace(angle=30.0) != one
    assert dict(one.without("angle")) == {"compression": 0.5}


def test_controls_change_units_once():
    model = band()
    parameters = model.parameters(model.setting(angle=15.0, poisson=0.3))
    assert parameters["psi0"] == math.radians(15.0)
    assert parameters["a"] == (1.0 + 0.3) / 2.0
    state = state_at(Ends(15.0))
    assert model.value("angle", state) == pytest.approx(15.0, abs=1e-12)
    assert model.value("poisson", state) == pytest.approx(0.25, abs=1e-15)


@pytest.mark.parametrize(("values", "message"), [
    ({"angel": 3.0}, "control: expected one of poisson, compression, angle,.* got 'angel'"),
    ({"angle": 95.0}, "angle: expected degrees with 0 <= angle < 90, got 95.0"),
    ({"angle": "3"}, "angle: expected degrees with 0 <= angle < 90, got '3'"),
    ({"compression": 1.0}, "compression: expected a number between 0 and 1 .* got 1.0"),
    ({"poisson": 0.6}, r"poisson: expected a number with -1 < nu <= 0.5, got 0.6"),
    ({"compression": 0.5, "shear": 0.9}, "shear: expected a number of size below 0.866025, .* got 0.9|compression: .*"),
])  # fmt: skip
def test_wrong_settings_are_told_in_a_line(values, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        band().setting(**values)


def test_a_setting_has_the_symmetries_that_leave_its_parameters_alone():
    model = band()

    def there(**values):
        return set(fixing(model, list(model.parameters(model.setting(**values)).values())))

    assert there(angle=15.0, shear=0.3) == {"reversal"}
    assert there(angle=0.0, shear=0.3) == {"reversal", "angle mirror"}
    assert there(angle=15.0) == {"reversal", "shear mirror"}
    assert there(angle=0.0) == {"reversal", "angle mirror", "shear mirror"}


def test_members_of_a_pair_are_one_state(slice_15):
    model = slice_15.settings.model
    state = next(s for s in slice_15.states if s.name == "US+-")
    one = state.solutions[len(state.solutions) // 2]
    assert group(model, one) == ("reversal",)
    assert own_symmetries(model, one) == frozenset()
    assert not is_alone(model, one)
    both = members(model, one)
    assert len(both) == 2
    assert same_state(model, *both)
    assert {model.sign_of(m) for m in both} == {"+", "-"}
    assert {model.sign_of(model.member(m, "+")) for m in both} == {"+"}
    u = state_at(Ends(15.0, 0.5, 0.1))
    assert is_alone(model, u)
    assert len(members(model, u)) == 1
    assert not same_state(model, u, one)


def test_states_without_invariants_are_compared_as_they_are(slice_15):
    """The same answers, by whole solutions instead of declared numbers."""
    bare = replace(slice_15.settings.model, invariants=())
    state = next(s for s in slice_15.states if s.name == "US+-")
    one, two = state.solutions[5], state.solutions[6]
    first, second = members(bare, one)
    assert same_state(bare, first, second)
    assert not same_state(bare, one, two)
    again = solve(bare.problem, one, ("dD",))
    assert same_state(bare, one, again)


def test_a_model_goes_to_other_processes_by_its_name():
    settings = SliceSettings.of(arch_model())
    assert pickle.loads(pickle.dumps(settings)) == settings
    assert pickle.loads(pickle.dumps(band())) is band()
    lost = replace(arch_model(), name="nobody knows it")
    with pytest.raises(ValueError, match=r"^model: expected one that is registered, .* got Model"):
        pickle.dumps(lost)


def test_models_by_name():
    assert model_named("band") is band()
    assert model_named("arch") is arch_model()
    with pytest.raises(ValueError, match=r"^model: expected one of .*band.*, got 'bend'"):
        model_named("bend")
    with pytest.raises(ValueError, match=r"^model: expected one that can be made, got 'x' of nowhere:x"):
        model_named("x", "nowhere:x")


def test_the_identity_of_a_result_changes_with_the_problem():
    """Whoever changes an equation gets no results of the old one."""
    assert arch_model().identity() != bare_arch_model().identity() | {"model": "arch"}
    assert band().identity() == {"model": "band"}  # its code is part of the identity otherwise

    def problem(factor):
        return BVP(lambda s, u, p: [u.v, -factor * p.q * u.y], lambda a, b, p: [a.y, b.y - 1],
                   unknowns=("y", "v"), parameters={"q": 1.0})  # fmt: skip

    assert fingerprint(problem(1.0)) == fingerprint(problem(1.0))
    assert fingerprint(problem(1.0)) != fingerprint(problem(1.5))


def test_the_identity_changes_with_units_and_functions():
    """A file is not read for a control that means something else now, nor for another index."""
    model = arch_model()
    rise, load = model.controls
    for other in (
        replace(model, controls=(rise, replace(load, scale=1.0))), replace(model, index=lambda solution: 0),
        replace(model, sources=(Source("others", lambda setting, tolerance, keep: ([], [])),)),
        replace(model, pairing=()),
    ):  # fmt: skip
        assert other.identity() != model.identity()
    assert replace(model).identity() == model.identity()


@pytest.mark.parametrize(("changes", "message"), [
    ({"controls": (LOAD, replace(LOAD, name="r"))}, "controls: expected one for each parameter, got two for 'q'"),
    ({"controls": (replace(LOAD, scale=0.0),)}, "controls: expected a scale that is not 0, .* got 0 for load"),
    ({"controls": (replace(LOAD, derived=True),)}, "controls: expected one that is not derived, got none"),
    ({"quantities": (Quantity.of("a"), Quantity.of("a"))}, "quantities: expected names of their own, got 'a' twice"),
    ({"name": "a/b"}, "name: expected a name that can be part of a file's, got 'a/b'"),
])  # fmt: skip
def test_models_that_cannot_work(changes, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        replace(arch_model(), **changes)


@pytest.mark.parametrize(("changes", "message"), [
    ({"controls": (Control("load", "qq", "q", 0.0),)}, "controls: expected names of the problem, q, h, N, got 'qq'"),
    ({"free": ("M",)}, "free: expected names of the problem, q, h, N, got 'M'"),
    ({"pairing": ("mirror",)}, "pairing: expected names of the problem, reversal, got 'mirror'"),
    ({"order": ("b",)}, "order: expected names of the problem, a, got 'b'"),
])  # fmt: skip
def test_what_a_problem_lacks_is_told_when_it_is_made(changes, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        assert replace(arch_model(), **changes).problem


def test_names_of_the_package_are_taken():
    with pytest.raises(ValueError, match=r"^name: expected one that is no model's of the package, got 'band'$"):
        register(lambda: replace(arch_model(), name="band"))


def test_a_model_needs_controls_quantities_and_starts():
    load, seen = Control("load", "q", "q", 0.0), Quantity.of("a")
    source = Source("none", lambda setting, tolerance, keep: ([], []))
    with pytest.raises(ValueError, match=r"^controls: expected at least one Control, got none$"):
        Model("m", arch_model().build, (), (seen,), (source,))
    with pytest.raises(ValueError, match=r"^quantities: expected Quantity objects, got 'a'$"):
        Model("m", arch_model().build, (load,), ("a",), (source,))


def test_a_slice_wants_a_range_where_none_is_usual():
    load, seen = Control("load", "q", "q", 0.0), Quantity.of("a")
    source = Source("none", lambda setting, tolerance, keep: ([], []))
    model = Model("m", arch_model().build, (load,), (seen,), (source,), free=("N",))
    with pytest.raises(ValueError, match=r"^range: expected the least and largest load, .*, got none$"):
        SliceSettings.of(model)
    assert SliceSettings.of(model, low=0.0, high=2.0).anchor == 0.0
    with pytest.raises(ValueError, match=r"^load-min: expected a number from .* to below 2, .*, got 3.0$"):
        SliceSettings.of(model, low=3.0, high=2.0)
    assert np.isclose(SliceSettings.of(model, low=1.0, high=3.0).anchor, 1.0)
