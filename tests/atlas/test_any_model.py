"""The atlas of a problem that is no rod: slice, loci and plane of a shallow arch against closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from arch_model import arch_model, bare_arch_model, buckling_loads, limit_loads, stable_count
from rodatlas.atlas import (
    Loci,
    LociSettings,
    PhaseDiagram,
    PhaseSettings,
    Slice,
    SliceSettings,
    compute_loci,
    compute_phase,
    compute_slice,
)
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.model import Seed
from rodatlas.model.model import Source

H = 3.0


@pytest.fixture(scope="module")
def found():
    return compute_slice(SliceSettings.of(arch_model()))


@pytest.fixture(scope="module")
def loci():
    settings = LociSettings.of(arch_model())
    return compute_loci(settings, lambda rise: compute_slice(settings.slice_at(rise)))


@pytest.fixture(scope="module")
def plane(loci):
    settings = PhaseSettings.of(arch_model())
    return compute_phase(settings, loci, lambda rises: [compute_slice(settings.slice_at(h)) for h in rises])


def events(found, kind):
    """Loads of the bifurcations of a kind on the first branch."""
    return sorted(e.value for e in found.branches[0].events if e.kind == kind)


@pytest.mark.parametrize("symmetric", [True, False])
def test_bifurcations_of_a_slice(found, symmetric):
    """With the symmetry declared or without: the same states and events."""
    here = found if symmetric else compute_slice(SliceSettings.of(bare_arch_model()))
    assert here.warnings == ()
    assert events(here, "fold") == pytest.approx(limit_loads(H), abs=1e-7)
    assert events(here, "pitchfork") == pytest.approx(buckling_loads(H), abs=1e-7)
    assert [s.name for s in here.states] == ["A1", "A2"]
    assert [s.pair for s in here.states] == [False, False]
    high, low = buckling_loads(H)[::-1]
    assert here.states[0].span == pytest.approx((-6.0, high), abs=1e-7)
    assert here.states[1].span == pytest.approx((low, 15.0), abs=1e-7)
    assert all(s.high.snap or s.high.kind == "range" for s in here.states)


def test_the_side_branch_is_one_of_a_pair_only_where_the_symmetry_is_known(found):
    main, side = found.branches
    assert main.followed.symmetries == {"reversal"}
    assert not main.followed.pair
    assert side.followed.pair
    assert {e.special.index for e in side.events} <= {(1, 1), (None, 1), (1, None)}


def test_a_slice_survives_its_file(found, tmp_path):
    found.save(tmp_path / "arch.h5")
    again = Slice.load(tmp_path / "arch.h5")
    assert again.settings == found.settings
    assert again.to_json() == found.to_json()
    assert again.to_json()["model"] == "arch"
    assert again.to_json()["setting"] == {"rise": 3.0}
    assert again.to_json()["along"] == "load"


def test_a_state_is_solved_anywhere(found):
    from rodatlas.atlas import coexisting_states

    there = coexisting_states(found, 3.0)
    assert set(there) == {"A1", "A2"}
    for s in there.values():
        a = s["a"]
        assert H - a + a * (H**2 - a**2) == pytest.approx(3.0, abs=1e-8)


def test_loci_are_those_of_the_closed_form(loci):
    assert loci.warnings == ()
    assert len(loci.curves) == 2  # one of folds through the cusp, one of branch points
    for piece in loci.pieces:
        low, _ = piece.span
        exact = limit_loads if piece.kind == "fold" else buckling_loads
        for rise, load, _ in piece.places[1:-1]:
            assert min(abs(load - x) for x in exact(rise)) < 1e-6
        assert low == pytest.approx(1.0 if piece.kind == "fold" else 2.0, abs=1e-6)


def test_special_points_of_loci(loci):
    """Cusp at h = 1; both branch points vanish at h = 2; fold and branch point meet at h^2 = 11/2."""
    told = {(e.kind, e.parameter): e for e in loci.events()}
    assert told["cusp", ""].second == pytest.approx(1.0, abs=1e-7)
    assert told["cusp", ""].value == pytest.approx(1.0, abs=1e-7)
    assert told["extremum", "rise"].second == pytest.approx(2.0, abs=1e-6)
    assert told["extremum", "load"].second == pytest.approx(np.sqrt(1.5), abs=1e-6)
    meets = [e.second for e in loci.events() if e.kind == "coalescence"]
    assert meets == pytest.approx([np.sqrt(5.5)] * 2, abs=1e-6)


def test_faces_have_the_stable_states_of_the_closed_form(plane):
    assert plane.warnings == ()
    rng = np.random.default_rng(1)
    for rise, load in zip(rng.uniform(0.5, 4.0, 60), rng.uniform(-6.0, 15.0, 60), strict=True):
        edges = [*limit_loads(rise)] if rise > 1.0 else []
        edges += [*buckling_loads(rise)] if rise > 2.0 else []
        if min((abs(load - x) for x in edges), default=1.0) > 0.02:
            assert len(plane.stable_at(rise, load)) == stable_count(rise, load), (rise, load)


def test_results_of_a_folder_are_read_again(tmp_path):
    model = arch_model()
    settings = SliceSettings.of(model, low=-2.0, high=12.0)
    first = obtain_slice(settings, tmp_path)
    said = []
    assert obtain_slice(settings, tmp_path, say=said.append).to_json() == first.to_json()
    assert "read from" in said[0]
    assert (tmp_path / "slice-arch-load--2to12.h5").exists()


@pytest.mark.slow
def test_planes_and_loci_of_a_folder_are_read_again(tmp_path):
    from rodatlas.atlas.phase.obtain import obtain_phase

    plane = obtain_phase(PhaseSettings.of(arch_model()), tmp_path, workers=1)
    assert PhaseDiagram.load(tmp_path / "phase-arch.h5").to_json() == plane.to_json()
    loci = obtain_loci(LociSettings.of(arch_model()), tmp_path)
    assert Loci.load(tmp_path / "loci-arch.h5").to_json() == loci.to_json()


def test_a_slice_without_any_start_says_so(found):
    """A seed at another setting, from which a fold bars the way: the arch of rise 3 that has snapped, to rise 1/2."""

    def snapped(setting, tolerance, keep):
        """On the branch of rise 3 that a rise of 1/2 does not have."""
        return [Seed("snapped", min(found.states[1].solutions, key=lambda s: abs(s["q"])))], []

    model = replace(arch_model(), sources=(Source("snapped", snapped),))
    empty = compute_slice(SliceSettings.of(model, rise=0.5, low=-1.0, high=1.0))
    assert empty.branches == ()
    assert [w.partition(":")[0] for w in empty.warnings] == ["no branch"]
