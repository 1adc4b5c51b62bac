"""Loci of the band's bifurcations: the events of the paper, agreement with other slices, file and JSON."""

import json
from dataclasses import replace

import numpy as np
import pytest

from rodatlas.atlas import Loci, compute_loci
from rodatlas.atlas.loci.compute import _anchors
from rodatlas.cli import main
from rodatlas.continuation import EndReason, Status, StepControl, TraceOptions, follow_locus, trace
from rodatlas.paper.model import band_loci
from rodatlas.rods import rod_problem
from rodatlas.rods.stability import morse_index_of

NUMBERS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 18)


def events(loci, number, kind, parameter=""):
    """Angle and partners of the special points of a kind on a locus."""
    found = [e for e in loci.numbered(number).events if (e.event.kind, e.event.parameter) == (kind, parameter)]
    assert all(e.event.status is Status.CONVERGED for e in found)
    return [(e.second, e.numbers) for e in found]


def test_every_locus_is_found(loci):
    assert loci.warnings == ()
    assert sorted(p.number for p in loci.pieces if p.number is not None) == [*NUMBERS]
    kinds = {p.number: p.kind for p in loci.pieces}
    assert {n for n, kind in kinds.items() if kind == "pitchfork" and n is not None} == {0, 3, 4, 8, 9, 10, 11, 15}


@pytest.mark.parametrize(("number", "kind", "angle", "partners"), [
    (6, "cusp", 0.135, (7,)),  # w is born
    (7, "cusp", 0.135, (6,)),
    (7, "extremum", 27.71, (13,)),  # the w branch touches the U branch
    (18, "extremum", 27.71, (13,)),
    (6, "extremum", 30.62, (14,)),  # U-w meets uUui
    (11, "extremum", 56.293, (15,)),  # 11 and 15 annihilate
    (4, "extremum", 28.147, (9,)),  # 4 and 9 annihilate
    (4, "criticality", 26.2916, (12,)),  # 4 turns subcritical, 12 is born
    (12, "criticality", 26.2916, (4,)),
    (3, "criticality", 41.7449, (5,)),
    (5, "criticality", 41.7449, (3,)),
    (9, "coalescence", 27.5096, (7,)),
    (1, "cusp", 26.892, ()),  # TW ends, at dD = 0
    (2, "extremum", 74.027, ()),  # TU ends, at dD = 0
    (14, "coalescence", 44.1702, (10,)),
])  # fmt: skip
def test_events(loci, number, kind, angle, partners):
    near = [e for e in events(loci, number, kind, "psi0" if kind == "extremum" else "") if abs(e[0] - angle) < 0.002]
    assert len(near) == 1, events(loci, number, kind)
    assert set(partners) <= set(near[0][1])


def test_loci_are_known_up_to_a_shear_of_0_86(loci):
    """Forces grow to 2e5 there, nearly the limiting shear of 0.866; meshes follow and nothing ends before."""
    for curve in loci.curves:
        assert set(curve.ends) <= {EndReason.RANGE, EndReason.CRITICALITY}
        assert max(p.solution.error for p in curve.points) < 1e-8
    ends = {round(p.solution["dD"], 9): p.solution for c in loci.curves for p in (c.points[0], c.points[-1])}
    assert np.abs(ends[0.86].values[:, :3]).max() > 1e5


def test_us_turns_back_near_the_limiting_shear(loci):
    """At 55 degrees the paper has this fold (17) of US at about 0.856; a slice up to 0.862 has it at 0.8556700731."""
    folds = [p for p in loci.pieces if p.kind == "fold" and p.span[0] < 55.0 < p.span[1]]
    assert max(p.at(55.0)[0] for p in folds) == pytest.approx(0.8556700731, abs=1e-6)


def test_u_is_stable_again_near_the_limiting_shear(loci):
    """Where uUu is lost at lower shear: two more loci, met by a branch at constant angle; the index tells them."""
    fold = max((p for p in loci.pieces if p.kind == "fold" and p.number is None), key=_top)
    pitchfork = max((p for p in loci.pieces if p.kind == "pitchfork" and p.number is None), key=_top)
    start = next(s for s in fold.points if s["dD"] > 0.852)
    angle = float(np.degrees(start["psi0"]))
    shear = pitchfork.at(angle)[0]
    options = TraceOptions(bounds={"dD": (0.8, shear + 3e-4)}, step=StepControl(maximum=20.0))
    branch = trace(rod_problem(), start, ("dD",), options)
    (turn,), (crossed,) = branch.of_kind("fold"), branch.of_kind("branch point")
    assert turn.solution["dD"] == pytest.approx(start["dD"], abs=1e-9)
    assert crossed.solution["dD"] == pytest.approx(shear, abs=1e-6)
    assert sorted(morse_index_of(p.solution) for p in (branch.points[0], branch.points[-1])) == [0, 2]


def _top(piece):
    return piece.points[-1]["dD"]


def test_what_happens_is_said(loci):
    said = {(p.number, round(e.second, 2)): e.event.what for p in loci.pieces for e in p.events if p.number}
    assert said[7, 27.71] == "two branches touch: they merge and split"
    assert said[11, 56.29] == "two branch points meet and vanish"


def test_loci_pass_through_the_slice_at_30_degrees(loci, slice_30):
    """Independent of each other: a fold or pitchfork of that slice, and the locus traced from 15 degrees."""
    compared = set()
    for b in slice_30.branches:
        for e in b.events:
            if e.number in NUMBERS:
                shear, height = loci.numbered(e.number).at(30.0)
                assert shear == pytest.approx(e.value, abs=2e-4), e
                assert height == pytest.approx(e.response, abs=2e-4), e
                compared.add(e.number)
    assert compared == {0, 2, 3, 5, 6, 8, 10, 11, 12, 13}


def test_a_locus_meets_the_slice_at_30_degrees_exactly(slice_15, slice_30):
    event = next(e for b in slice_15.branches for e in b.events if e.number == 10)
    angle = np.radians(30.0)
    options = TraceOptions(bounds={"psi0": (0.2, 0.6)}, zeros={"psi0": angle})
    (met,) = follow_locus(rod_problem(), event.special, ("dD", "psi0"), options).of_kind("zero of psi0")
    (other,) = {round(e.value, 8) for b in slice_30.branches for e in b.events if e.number == 10}
    assert met.solution["psi0"] == pytest.approx(angle, abs=1e-9)
    assert met.solution["dD"] == pytest.approx(other, abs=1e-7)


class Followed:
    """The curves of other loci under the names by which they are asked for, and which were."""

    def __init__(self, loci):
        self.loci, self.asked = loci, set()

    def get(self, key, form):
        self.asked.add(key)
        return self.loci.curves[self.loci.numbered(int(key.rpartition("-")[2])).curve]

    def put(self, key, part, form):
        raise AssertionError(f"{key} was followed again")


@pytest.mark.parametrize("numbers", [(n,) for n in NUMBERS] + [(4, 12), (3, 14), (6, 13, 18)])
def test_some_loci_are_told_as_all_are(numbers, loci, slice_15):
    """Only what is needed is followed, and what meets the wanted ones is the same, word for word."""
    cache, said = Followed(loci), []
    found = compute_loci(band_loci(), lambda angle: slice_15, numbers, lambda *report: said.append(report[0]), cache)
    assert found.warnings == ()
    plain, whole = found.to_json(), loci.to_json(numbers)
    assert plain["loci"] == whole["loci"]
    assert plain["events"] == whole["events"]
    assert [x["number"] for x in plain["loci"]] == sorted(numbers)
    assert set(found.to_frame()["number"]) <= set(numbers)
    if numbers == (4, 12):
        assert cache.asked == {"locus-4", "born-12"}
        assert said == ["locus 4"]
    if numbers == (12,):
        assert said == ["locus 4, from which 12 may come"]
    if numbers == (14,):
        assert said == ["locus 6, from which 14 may come", "locus 8, which may meet 14"]


def test_numbers_that_no_bifurcation_has(loci):
    assert loci.numbered(17) is None
    with pytest.raises(ValueError, match=r"^number: expected one of 0 to 18, got 19$"):
        loci.numbered(19)


def test_two_bifurcations_of_one_number_are_said(slice_15):
    """As at dL = 0.95, where two mirror images of W may end at pitchforks of their own."""
    moved = [
        replace(e, value=0.3, special=replace(e.special, solution=e.special.solution.with_parameters(dD=0.3)))
        for b in slice_15.branches for e in b.events if e.number == 4
    ]  # fmt: skip
    double = replace(slice_15, branches=(*slice_15.branches, replace(slice_15.branches[0], events=tuple(moved))))
    events, warnings = _anchors(double, {4}, 15.0, 15.0, band_loci())
    assert [e.number for e in events].count(4) == 1
    assert warnings == [
        "locus 4: the slice at angle 15 has 2 bifurcations of this number, at shear 0.3 and 0.327675; only the one at "
        "0.327675 is followed"
    ]
    assert _anchors(double, {5}, 15.0, 15.0, band_loci())[1] == []


def test_special_points_near_the_limiting_shear_are_said(loci):
    """At dL = 1/2 no numbered locus but 17 has one; where the limit is nearer, others do."""
    assert loci.remarks() == ()
    nearer = replace(loci, settings=band_loci(0.25))  # the limiting shear is 0.661
    (told,) = nearer.remarks((11,))
    assert told.startswith("limiting shear: 0.63559 is 0.961 of the limiting shear 0.661438")
    assert told.endswith("(special points of locus 11)")
    assert told in nearer.to_json((11,))["warnings"]


def test_file(loci, tmp_path):
    loci.save(tmp_path / "loci.h5")
    again = Loci.load(tmp_path / "loci.h5")
    assert again.to_json() == loci.to_json()
    assert again.wanted == NUMBERS


@pytest.mark.slow
def test_command_line(slice_15, tmp_path, capsys):
    slice_15.save(tmp_path / "slice-15.h5")
    arguments = ["loci", "--number", "4", "--number", "12", "--out", str(tmp_path), "--json", "-"]
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    assert stop.value.code == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "rodatlas/loci/1"
    assert [x["number"] for x in found["loci"]] == [4, 12]
    assert [x["kind"] for x in found["loci"]] == ["pitchfork", "fold"]
    for locus in found["loci"]:
        points = np.array(locus["points"])
        assert points.shape[1] == 3
        assert np.all(np.diff(points[:, 0]) > 0)
        for event in locus["events"]:
            assert {"kind", "angle_deg", "shear", "with", "status"} <= set(event)
    assert {p.name for p in tmp_path.glob("loci*")} == {f"loci-4-12.{x}" for x in ("h5", "json", "png", "pdf")}
    with pytest.raises(SystemExit):
        main(arguments)
    again = capsys.readouterr()
    assert "read from" in again.err
    assert json.loads(again.out) == found


@pytest.mark.parametrize(("arguments", "message"), [
    (["--number", "x"], "number: expected a whole number, got 'x'"),
    (["--number", "19"], "number: expected one of 0 to 18, got 19"),
    (["--all", "--number", "4"], "all: expected no --number beside --all"),
    (["--angle-max", "95"], "angle-max: expected degrees with 15 <= angle-max < 90, got 95"),
    (["--poisson", "1"], "poisson: expected a number with -1 < nu <= 0.5, got 1"),
])  # fmt: skip
def test_wrong_input(arguments, message, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["loci", *arguments])
    assert stop.value.code == 2
    assert message in capsys.readouterr().err
