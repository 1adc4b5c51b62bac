"""Phase diagrams of two windows of the plane: near 30 degrees, where most happens, and where one path is left."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rodatlas.atlas import PhaseDiagram, compute_phase, compute_slice
from rodatlas.atlas.phase.arrangement import polygon_of
from rodatlas.atlas.phase.complete import stable_names
from rodatlas.atlas.slices.branches.follow import carried_from
from rodatlas.atlas.study import Study
from rodatlas.atlas.study.inspection import inspect_file
from rodatlas.cli import main
from rodatlas.paper.model import band_loci, band_phase, band_slice
from rodatlas.rods.ends import Ends
from rodatlas.states import find_states

pytestmark = pytest.mark.slow


def slices_of(slice_15, *known):
    """Slices of the usual range of shear, computed when asked for unless they are known; and what was asked for.

    States are carried from the slice at 15 degrees.
    """
    there = {s.settings.setting["angle"]: s for s in known}
    asked = []
    reference = carried_from(slice_15.settings.model, (b.followed for b in slice_15.branches))

    def slices(angles):
        asked.extend(angles)
        for a in angles:
            yield there.get(a) or compute_slice(band_slice(a, search=0), reference=lambda settings: reference)

    return slices, asked


@pytest.fixture(scope="session")
def diagram(loci, slice_15, slice_30):
    slices, _ = slices_of(slice_15, slice_30)
    return compute_phase(band_phase(angle_min=29.5, angle_max=31.0), loci, slices, [30.0])


@pytest.fixture(scope="session")
def last(loci, slice_15):
    """Large angles, where a single path is left."""
    slices, _ = slices_of(slice_15)
    return compute_phase(band_phase(angle_min=76.6, angle_max=80.0), loci, slices)


def test_all_adds_up(diagram):
    assert diagram.warnings == ()
    assert len(diagram.places) <= 4


def test_faces_fill_the_plane_and_are_known(diagram):
    low, high, bottom, top = diagram.settings.frame
    assert sum(polygon_of(f.rings).area for f in diagram.faces) == pytest.approx((high - low) * (top - bottom))
    assert all(f.states is not None for f in diagram.faces)


def test_five_states_coexist_at_30_degrees(diagram):
    """MODEL: exactly uUui, w, uUu, US+ and US- at psi0 = 30, dD = 0.625."""
    assert diagram.stable_at(30.0, 0.625) == ("US+-", "uUu", "uUui", "w")
    (face,) = [f for f in diagram.faces if polygon_of(f.rings).contains(_point(30.0, 0.625))]
    assert face.count == 5


def _point(angle, shear):
    import shapely

    return shapely.Point(angle, shear)


def test_the_merge_with_uUui_is_told(diagram):
    """The paper: at 30.62 degrees U-w meets uUui; from the cusp at 30.635 on there is one path U-w-uUui."""
    told = {e.description: e.second for e in diagram.events}
    assert told["the U-w branch touches the uUui branch: folds 6' and 14 are born"] == pytest.approx(30.62, abs=0.002)
    assert told["w joins uUui: folds 6 and 6' annihilate in a cusp"] == pytest.approx(30.6346, abs=0.001)


def test_regions_are_bounded_by_the_loci_of_their_ends(diagram):
    def bounds(name):
        (region,) = diagram.state_regions(name)
        return set(region.bounds) - {"frame"}

    assert bounds("U") == {"U|w"}
    assert bounds("w") == {"U|w", "6", "w|uUui"}
    assert bounds("WS+-") == {"3", "5"}
    assert bounds("US+-") == {"12"}
    assert bounds("uUu") == {"11"}
    assert bounds("W") == {"3"}
    assert bounds("TU+-") == {"2"}
    assert diagram.state_regions("TW+-") == ()
    assert {b for r in diagram.state_regions("uUui") for b in r.bounds} - {"frame"} == {"10", "14", "6'", "w|uUui"}


def test_the_gap_in_uUui_opens_between_its_two_folds(diagram, loci):
    """Just above 30.62 degrees w is alone between fold 14 and the fold at which the upper uUui ends."""
    angle = 30.63
    upper = next(p for p in loci.pieces if p.number is None and p.span[0] > 30.6 and p.span[1] < 30.7)
    low, high = loci.numbered(14).at(angle)[0], upper.at(angle)[0]
    assert low < high
    assert "uUui" not in diagram.stable_at(angle, 0.5 * (low + high))
    assert "uUui" in diagram.stable_at(angle, low - 2e-4)
    assert "uUui" in diagram.stable_at(angle, high + 2e-4)


@pytest.mark.parametrize(("angle", "shear"), [(30.83, 0.391), (29.72, 0.6102)])
def test_a_search_at_one_point_finds_the_same_states(diagram, angle, shear):
    """Independent of slices and loci: equilibria from random starts, stable by their Morse index."""
    found = find_states(Ends(angle, 0.5, shear), classes="+", stable_only=True)
    states = [s for s in found.states if s.stable and abs(s.twist) < np.pi]
    count = sum(2 if name.endswith("+-") else 1 for name in diagram.stable_at(angle, shear))
    assert len(states) == count
    symmetric = [n for n in diagram.stable_at(angle, shear) if not n.endswith("+-")]
    assert sum(s.pair is None for s in states) == len(symmetric)


def test_slices_agree_with_the_faces_everywhere(diagram, slice_30):
    """Along 30 degrees, at shears that were not sampled."""
    rng = np.random.default_rng(5)
    for shear in rng.uniform(-0.05, 0.82, 60):
        assert diagram.stable_at(30.0, shear) == stable_names(slice_30, shear, diagram.settings)


def test_only_one_path_is_left_above_77_degrees(last):
    assert last.warnings == ()
    high = [(a, d) for a in (77.2, 78.4, 79.8) for d in np.linspace(-0.0999, 0.8599, 30)]
    assert {n for point in high for n in last.stable_at(*point)} == {"U", "w", "uUui"}
    assert all(len(last.stable_at(*point)) == 1 for point in high)
    (region,) = last.state_regions("W")
    assert region.rings[0][:, 0].max() == pytest.approx(76.9499, abs=1e-3)
    assert "W is no longer stable: pitchfork 3 and its mirror image annihilate" in {e.description for e in last.events}


def test_symmetric_in_shear(last):
    """dD to -dD is a symmetry of the band; both sides were computed."""
    for angle in np.linspace(76.65, 79.9, 14):
        for shear in np.linspace(0.001, 0.099, 14):
            assert last.stable_at(angle, shear) == last.stable_at(angle, -shear)
    shears = last.state_regions("W")[0].rings[0][:, 1]
    assert shears.max() == pytest.approx(-shears.min(), abs=3e-4)


def test_file_and_tables(diagram, tmp_path):
    diagram.save(tmp_path / "phase.h5")
    again = PhaseDiagram.load(tmp_path / "phase.h5")
    assert again.to_json() == diagram.to_json()
    assert again.settings == diagram.settings
    found = json.loads(json.dumps(diagram.to_json()))
    assert found["schema"] == "rodatlas/phase/1"
    assert {f["count"] for f in found["faces"]} >= {3, 4, 5}
    assert set(diagram.to_frame("regions")["state"]) == set(diagram.names)
    assert list(diagram.to_frame()["description"]) == [e.description for e in diagram.events]
    assert len(diagram.to_frame("faces")) == len(diagram.faces)
    (tmp_path / "phase.h5").write_bytes((tmp_path / "phase.h5").read_bytes()[:3000])
    with pytest.raises(ValueError, match="damaged"):
        PhaseDiagram.load(tmp_path / "phase.h5")


def test_points_outside_are_refused(diagram):
    with pytest.raises(ValueError, match=r"angle: expected one from 29.5 to 31, got 10"):
        diagram.stable_at(10.0, 0.1)
    with pytest.raises(ValueError, match=r"shear: expected one from -0.1 to 0.86, got 0.9"):
        diagram.stable_at(30.0, 0.9)
    with pytest.raises(ValueError, match="name: expected one of U, US"):
        diagram.state_regions("V")


def test_a_wrong_slice_is_noticed(loci, slice_15, slice_30):
    """A slice without one of its states contradicts the loci: pitchfork 11 would do nothing."""
    broken = replace(slice_30, states=tuple(s for s in slice_30.states if s.name != "W"))
    settings = band_phase(angle_min=29.9, angle_max=30.1)
    slices, asked = slices_of(slice_15, broken)
    found = compute_phase(settings, loci, slices, [30.0])
    assert asked == [30.0]
    assert found.warnings == (
        "Crossing(pitchfork 3 at 30, 0.381067: +WS+-) is more than a pitchfork can do",
    )  # fmt: skip


def test_command_line_reads_the_stored_diagram(diagram, tmp_path, capsys):
    diagram.save(tmp_path / "phase-from29.5-to31.h5")
    arguments = ["phase", "--angle-min", "29.5", "--angle-max", "31", "--out", str(tmp_path), "--json", "-"]
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 0
    shown = capsys.readouterr()
    identity = diagram.settings.identity()
    assert json.loads(shown.out) == json.loads(json.dumps(diagram.to_json() | {"identity": identity}))
    assert "read from" in shown.err
    stem = "phase-from29.5-to31"
    names = {p.name for p in tmp_path.iterdir() if p.is_file()}
    assert names == {f"{stem}{x}" for x in (".h5", ".json", ".png", ".pdf", "-states.png", "-states.pdf")}


@pytest.mark.parametrize(("arguments", "message"), [
    (["--angle-min", "90"], "angle-min: expected degrees with 0 <= angle-min <= 89, got 90"),
    (["--workers", "0"], "workers: expected a whole number from 1 to 1024, got 0"),
    (["--workers", "two"], "workers: expected a whole number from 1 to 1024, got 'two'"),
    (["--compression", "1.5"], "compression: expected"),
])  # fmt: skip
def test_wrong_input(arguments, message, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["phase", *arguments])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.strip().splitlines()) == 1


def test_phase_diagrams_are_tasks_of_studies(tmp_path, diagram):
    """Their loci come first; a stored diagram is read by the inspection of folders."""
    (tmp_path / "sweep.toml").write_text("[[phases]]\npoisson = [0.2, 0.3]\nangle_max = 20\n")
    tasks = Study.load(tmp_path / "sweep.toml").tasks
    wanted = [t.settings for t in tasks]
    for nu in (0.2, 0.3):
        assert wanted.index(band_loci(poisson=nu)) < wanted.index(band_phase(poisson=nu, angle_max=20.0))
    diagram.save(tmp_path / "phase.h5")
    entry = inspect_file(tmp_path / "phase.h5")
    assert (entry.kind, entry.warnings) == ("phase", 0)
    assert entry.contents == f"{len(diagram.lines)} lines, {len(diagram.faces)} faces"


def test_settings_of_loci_reach_80_degrees_at_least():
    assert band_phase(angle_max=30.0).loci == band_loci() == band_phase().loci
    assert band_phase(angle_max=85.0).loci.second_high == 85.0
