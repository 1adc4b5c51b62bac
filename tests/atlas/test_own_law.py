"""A law that the package does not know goes through the atlas: the softening rod of the examples."""

from pathlib import Path
from runpy import run_path
from types import SimpleNamespace

import numpy as np
import pytest

from rodatlas.atlas import SliceSettings, compute_slice
from rodatlas.continuation import TraceOptions, trace
from rodatlas.rods import RodState, anisotropic_rod

example = SimpleNamespace(**run_path(str(Path(__file__).parents[2] / "examples/models/softening_rod.py")))


@pytest.fixture(scope="module")
def slices():
    model = example.softening_model()
    return [compute_slice(SliceSettings.of(model, softening=g)) for g in (0.0, 0.002)]


def test_slices_add_up(slices):
    """Every change of the Morse index, which is counted with the compliance of the law, is at an event."""
    for found in slices:
        assert found.warnings == ()
        assert [s.name for s in found.states] == ["C1", "C2+-", "C3", "D1+-"]
        assert [b.followed.pair for b in found.branches] == [False, True, False, True]


def test_without_softening_it_is_the_anisotropic_rod(slices):
    """Another problem of the package, with a linear law of its own."""
    rod = anisotropic_rod()
    start = RodState(slices[0].branches[0].followed.branch.points[0].solution, example.softening_rod().formulation)
    branch = trace(rod.problem, start.rewritten(rod.formulation), ("dD",), TraceOptions(bounds={"dD": (-0.05, 0.45)}))
    (expected,) = branch.of_kind("branch point")
    (event,) = (e for e in slices[0].branches[0].events if e.kind == "pitchfork")
    assert event.value == pytest.approx(expected.solution["dD"], abs=1e-7)
    assert event.response == pytest.approx(expected.solution["height"], abs=1e-7)


def test_the_energy_falls_by_the_complementary_energy_of_the_softening(slices):
    """dE/dg = -int M1^4/4 between fixed clamps: the envelope theorem."""
    problem, formulation = example.softening_rod()
    start = slices[1].branches[0].followed.branch.points[3].solution
    g, step = start["g"], 1e-5
    branch = trace(problem, start, ("g",), TraceOptions(bounds={"g": (g - step, g + step)}))
    low, high = branch.points[0].solution, branch.points[-1].solution
    slope = (high["energy"] - low["energy"]) / (high["g"] - low["g"])
    rod = RodState(start, formulation).at_gauss_points()
    assert slope == pytest.approx(-start.mean(rod.moment_body[..., 0] ** 4) / 4, rel=1e-5)


def test_the_law_has_a_consistent_energy():
    """dW/dk = M: along the law, the change of energy is the moment times the change of strain."""
    law = example.SofteningLaw(0.625, 0.01, 0.002)
    moments = np.random.default_rng(3).normal(size=(20, 3)) * 10
    for m in moments:
        k, dm = np.array(law.strain(m)), 1e-6 * np.random.default_rng(4).normal(size=3)
        more = np.array(law.strain(m + dm))
        change = law.energy_density(more, m + dm) - law.energy_density(k, m)
        assert change == pytest.approx((m + dm / 2) @ (more - k), rel=1e-5)
        assert more - k == pytest.approx(np.array(law.compliance(m)) @ dm, rel=1e-4)
