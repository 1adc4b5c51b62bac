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
    coexisting_states,
    compute_loci,
    compute_phase,
    compute_slice,
)
from rodatlas.atlas.cache import MemoryCache
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.atlas.slices.branches.match import crossings
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.continuation import BVP, Solution, end_value
from rodatlas.model import Control, Model, Quantity, Seed
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


@pytest.mark.parametrize(("low", "high"), [(10.0, 15.0), (6.0, 9.0), (-1.0, 15.0), (-5.0, -4.0)])
def test_a_short_range_has_what_the_whole_has(found, low, high):
    """The arch that has snapped, and its side branches, are connected to the unloaded one beyond these ranges only."""
    short = compute_slice(SliceSettings.of(arch_model(), low=low, high=high))
    assert short.warnings == ()
    for load in np.linspace(low, high, 7)[1:-1]:
        wanted, met = ([s["a"] for s in coexisting_states(of, float(load)).values()] for of in (found, short))
        assert met
        assert sorted(met) == pytest.approx(sorted(wanted), abs=1e-6)
    for b in short.branches:
        assert all(low - 1e-9 <= short.settings.value(p.solution) <= high + 1e-9 for p in b.followed.branch.points)
    wanted = sorted({round(e.value, 6) for b in found.branches for e in b.events if low < e.value < high})
    assert sorted({round(e.value, 6) for b in short.branches for e in b.events}) == pytest.approx(wanted, abs=2e-6)


# -- a multiple branch point ------------------------------------------------------------------------------------------


def squared():
    """x (p - x^2 - 2 y^2) = 0 = y (p - y^2 - 2 x^2): where p = 0 four curves leave the trivial one."""
    bvp = BVP(
        lambda s, u, p: [0.0 * u.x, 0.0 * u.y],
        lambda u, right, p: [u.x * (p.lam - u.x**2 - 2 * u.y**2), u.y * (p.lam - u.y**2 - 2 * u.x**2)],
        unknowns=("x", "y"), parameters={"lam": -0.5}, observables={"x0": end_value(lambda left, right, p: left.x)},
    )  # fmt: skip
    zero = Solution.from_function(lambda s: np.zeros((len(s), 2)), bvp.unknowns, bvp.parameters)
    return Model(
        "square", lambda: bvp, (Control("p", "lam", "p", -0.5, usual=lambda at: (-1.0, 1.0)),), (Quantity.of("x0"),),
        (Source("trivial", lambda setting, tolerance, keep: ([Seed("zero", zero)], [])),),
    )  # fmt: skip


def test_all_branches_through_a_multiple_branch_point_and_from_a_cache():
    """At p = 0.5 the axes have x^2 = 1/2 or y^2 = 1/2, the diagonals x^2 = y^2 = 1/6."""
    settings = SliceSettings.of(squared())
    axis, diagonal = 0.5**0.5, (1 / 6) ** 0.5
    wanted = {(0, 0), *((a, 0) for a in (axis, -axis)), *((0, a) for a in (axis, -axis)),
              *((a, b) for a in (diagonal, -diagonal) for b in (diagonal, -diagonal))}  # fmt: skip
    cache = MemoryCache()
    first = compute_slice(settings, cache)
    again = compute_slice(settings, cache)
    assert first.warnings == ()
    assert [(b.id, len(b.followed.branch)) for b in again.branches] == [
        (b.id, len(b.followed.branch)) for b in first.branches
    ]
    met = {
        tuple(np.round(state(0.0)[0], 6) + 0.0)
        for b in again.branches for state in crossings(b.followed.branch, (0.5,), settings, most=9)
    }  # fmt: skip
    assert met == {tuple(np.round(np.array(w, float), 6) + 0.0) for w in wanted}
