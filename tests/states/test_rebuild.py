"""A state from its force and moment at the clamp alone, and searches as files for export."""

import pytest

from rodatlas.atlas.contents import shapes_of, tables_of
from rodatlas.atlas.open import open_result
from rodatlas.rods import Ends, RodState, state_at
from rodatlas.states.discover import Discovery, FoundState
from rodatlas.states.rebuild import rebuilt
from rodatlas.states.store import save_discovery


def test_the_published_state_from_its_clamp():
    """U at 45 degrees and shear 0.2, force and moment as printed: the height and energy that belong to them."""
    force = (-17.10825468, 10.49335466, -10.49335466)
    moment = (-3.89716349, -10.43520435, 2.28785197)
    found = rebuilt(Ends(45.0, 0.5, 0.2), force, moment, 8.272356559)
    assert found["height"] == pytest.approx(0.215493955, abs=1e-8)
    assert found["energy"] == pytest.approx(8.272356559, abs=1e-7)


@pytest.mark.parametrize(
    ("energy", "poisson", "message"), [(9.0, 0.25, "got one of 8.27236"), (8.27236, 0.4, "with energy 8.27236, got")]
)
def test_numbers_that_do_not_belong_together(energy, poisson, message):
    rod = RodState(state_at(Ends(45.0, 0.5, 0.2)))
    with pytest.raises(ValueError, match=rf"^state: expected N0, M0 of a state at angle 45, comp.*{message}"):
        rebuilt(Ends(45.0, 0.5, 0.2), rod.force_body[0], rod.moment_body[0], energy, poisson)


def test_a_stored_search_has_tables_and_shapes(tmp_path):
    ends = Ends(45.0, 0.5, 0.2)
    solution = state_at(ends)
    states = (FoundState(solution, "+", "U", 0, None, 3), FoundState(solution, "-", None, 1, None, 1))
    counts = {"starts": 8, "converged": 4, "distinct": 2, "unseen_estimate": 0.5, "unseen_probability": 0.25}
    path = tmp_path / "states.h5"
    save_discovery(path, Discovery(ends, states, **counts, force_range=None, dropped=0))
    found = open_result(path)
    assert list(shapes_of(found)) == ["U", "-2"]
    assert shapes_of(found, "-2")["-2"]["energy"] == solution["energy"]
    frame = tables_of(found, 3)[0][""]
    assert list(frame["class"]) == ["+", "-"]
    assert frame["N0_1"][0] == pytest.approx(-17.10825468, abs=1e-6)
