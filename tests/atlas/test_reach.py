"""Named states one by one: a search at the setting gives the state and the name that the slice gives."""

from dataclasses import replace

import pytest

from rodatlas.atlas.slices import reach as module
from rodatlas.atlas.slices.reach import reach
from rodatlas.atlas.slices.states.coexisting import solve_state
from rodatlas.cli import main
from rodatlas.continuation import Solution
from rodatlas.paper import model as paper_model
from rodatlas.paper.model import band, band_slice
from rodatlas.rods import Ends, RodState, index_of, is_symmetric, pair_member
from rodatlas.states import find_states

SHEAR = band().control("shear")
CAREFUL = replace(SHEAR, care=lambda value, at: "near")  # as if each shear were next to the limiting one
NEAR = replace(
    band_slice(15.0), model=replace(band(), controls=tuple(CAREFUL if c is SHEAR else c for c in band().controls))
)


@pytest.fixture
def no_slice(monkeypatch):
    """A slice must not be computed."""
    monkeypatch.setattr(module, "compute_slice", None)


def energies(slice_, shear):
    """Name and energy of all stable states of a slice at a shear."""
    there = [s for s in slice_.states if s.span[0] < shear < s.span[1]]
    return sorted((s.name, solve_state(s, shear, slice_.settings)["energy"]) for s in there)


@pytest.mark.parametrize(("angle", "shear"), [(15, 0.0), (15, 0.4), (15, 0.55), (30, 0.4), (30, 0.625), (30, 0.81)])
def test_a_search_at_one_setting_names_as_the_slice_does(angle, shear, request):
    """All stable states with their names, and none besides; at 0.81 forces reach 1600."""
    slice_ = request.getfixturevalue(f"slice_{angle}")
    found = find_states(Ends(float(angle), 0.5, shear), classes="+", starts=512, stable_only=True)
    mine = [(s.name.replace("+", "+-"), s.solution["energy"]) for s in found.states if s.pair != "-"]
    wanted = energies(slice_, shear)
    assert [name for name, _ in sorted(mine)] == [name for name, _ in wanted]
    for (_, one), (_, two) in zip(sorted(mine), wanted, strict=True):
        assert one == pytest.approx(two, rel=1e-7)


def test_w_and_u_are_told_apart_by_where_they_come_from(no_slice):
    """At 27.5 degrees and 0.38 the branch of w is not bent over yet; followed to dD = 0 it turns back."""
    w = reach(band_slice(27.5), "w", 0.38)
    assert w.source == "search"
    assert w.solution(0.5, "k1")[0] > 0
    assert RodState(w.solution).inflections["k1"] == 2


def test_the_short_stretch_of_uuui_is_not_w(no_slice):
    """At 37 degrees and 0.55 it has two inflections and lies below the clamps, as W does; W has ended there."""
    solution, source = reach(band_slice(37.0), "uUui", 0.55)
    assert source == "search"
    assert RodState(solution).inflections["k1"] == 2
    assert solution["height"] < 0
    assert solution["energy"] == pytest.approx(21.374419, abs=1e-5)


@pytest.mark.parametrize("sign", "+-")
def test_states_of_height_zero(sign, no_slice):
    solution, source = reach(band_slice(0.0), f"S{sign}", 0.6)
    assert source == "search"
    assert abs(solution["height"]) < 1e-8
    assert not is_symmetric(solution)
    assert index_of(solution).index == 0
    assert pair_member(solution) == sign


@pytest.mark.slow
def test_a_state_that_is_not_there_fails_from_the_search(no_slice, slice_15, tmp_path):
    """The line lists what is stable, how complete the search looks, and where the state is."""
    started = []
    message = (
        r"^state: expected one that is stable at angle 15 deg, compression 0.5, poisson 0.25 and shear 0.2 \(U, W; "
        r"1024 of 1024 starts converged, and "
        r"each of these was met \d{2,} times or more\), got 'uUu'; "
    )
    with pytest.raises(ValueError, match=message + "'rodatlas slice --angle 15' tells where it is$"):
        reach(band_slice(15.0), "uUu", 0.2, progress=lambda text, done, left: started.append(text))
    assert "longer search, since 512 starts met no uUu" in started
    slice_15.save(tmp_path / "slice-15.h5")
    with pytest.raises(ValueError, match=message + r"uUu is stable for shear 0\.6164 to 0\.8200$"):
        reach(band_slice(15.0), "uUu", 0.2, folder=tmp_path)
    (tmp_path / "slice-15.h5").unlink()
    for angle, name in ((15.0, "slice-15-search0"), (15.5, "slice-15.5")):  # the latter is of another band
        replace(slice_15, settings=band_slice(angle, search=0)).save(tmp_path / f"{name}.h5")
    (tmp_path / "slice-15-dL0.4.h5").write_text("no slice")
    told = r"uUu is stable for shear 0\.6164 to 0\.8200 in the slice from -0\.05 to 0\.82$"
    with pytest.raises(ValueError, match=message + told):
        reach(band_slice(15.0), "uUu", 0.2, folder=tmp_path)


def test_near_the_limiting_shear_the_slice_decides(slice_15, monkeypatch):
    """There a search meets little: it is not asked."""
    monkeypatch.setattr(paper_model, "find_states", None)
    monkeypatch.setattr(module, "compute_slice", lambda *arguments, **options: slice_15)
    said = []
    found = reach(NEAR, "uUu", 0.8, progress=lambda text, done, left: said.append(text))
    assert found.source == "slice"
    assert said == ["slice, since searches miss states at shear 0.8"]
    with pytest.raises(ValueError, match=r"0\.8 \(US\+-, uUu, uUui\), got 'W'; W is stable for shear -0\.0500 to"):
        reach(NEAR, "W", 0.8)


def test_where_no_start_converges_the_slice_decides(slice_15, monkeypatch):
    nothing = replace(find_states(Ends(15.0, 0.5, 0.4), 0.25, "+", 16, stable_only=True), states=(), wound_left_out=0)
    monkeypatch.setattr(paper_model, "find_states", lambda *arguments, **options: nothing)
    monkeypatch.setattr(module, "compute_slice", lambda *arguments, **options: slice_15)
    assert nothing.failed
    assert reach(band_slice(15.0), "US-", 0.4).source == "slice"


def test_a_stored_slice_is_used(slice_30, tmp_path, monkeypatch):
    slice_30.save(tmp_path / "slice-30.h5")
    monkeypatch.setattr(paper_model, "find_states", None)
    solution, source = reach(band_slice(30.0), "uUui", 0.625, folder=tmp_path)
    assert source == "stored slice"
    assert solution["energy"] == pytest.approx(21.988286, abs=1e-6)


def test_the_command_needs_no_file_name(tmp_path, monkeypatch, capsys, no_slice):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as leave:
        main(["solve", "--state", "TU+", "--angle", "15", "--shear", "0"])
    assert not leave.value.code
    assert "37.41955" in capsys.readouterr().out
    assert Solution.load("out/TU+-15-dD0.h5")["height"] == pytest.approx(0.202848, abs=1e-6)


def test_a_folder_that_is_not_there(tmp_path, capsys):
    with pytest.raises(SystemExit) as leave:
        main(["solve", "--state", "U", "--angle", "15", "--shear", "0", "--from", str(tmp_path / "no")])
    assert leave.value.code == 2
    assert capsys.readouterr().err.startswith("rodatlas: from: expected a folder with a slice, got")
