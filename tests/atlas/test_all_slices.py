"""All nine slices of the paper: which states, what ends them, and where, against the loci.

`slices.json` holds the states and numbered bifurcations of `rodatlas slice --angle A`. It is checked three ways: what
exists at each angle and what ends it against the paper; every numbered bifurcation against its locus, which is traced
in angle and shear from the slice at 15 degrees and knows nothing of the other slices; and the slices at 15, 30, 27.5
and 60 degrees, computed here, against the file.
"""

import json
from pathlib import Path

import pytest

from rodatlas.atlas import compute_slice
from rodatlas.paper.model import band_slice

REFERENCE = json.loads((Path(__file__).parent / "slices.json").read_text())["slices"]
ANGLES = (0.0, 5.0, 15.0, 27.5, 30.0, 37.0, 45.0, 55.0, 60.0)
EDGE = "range"
SMALL = {  # angles up to 15 degrees but not 0
    "U": (EDGE, 4), "US+-": (4, EDGE), "uUu": (11, EDGE), "w": (7, 6), "W": (EDGE, 3), "WS+-": (3, 5),
    "uUui": (10, EDGE), "TU+-": (EDGE, 2), "TW+-": (EDGE, 1),
}  # fmt: skip
LARGE = {"U": (EDGE, "smooth"), "w": ("smooth", "smooth"), "uUui": ("smooth", EDGE), "W": (EDGE, 3), "TU+-": (EDGE, 2)}
PAPER = {  # name: what it begins and ends at, with rising shear
    0.0: {
        "U": (EDGE, 4), "US+-": (4, "pitchfork"), "uUu": (11, EDGE), "W": (EDGE, 3), "WS+-": (3, "pitchfork"),
        "uUui": (10, EDGE), "S+-": ("pitchfork", EDGE), "TU+-": (EDGE, 2), "TW+-": (EDGE, 1),
    },
    5.0: SMALL,
    15.0: SMALL,
    27.5: {name: ends for name, ends in SMALL.items() if name != "TW+-"} | {"US+-": (12, EDGE)},
    30.0: {
        "U": (EDGE, "smooth"), "w": ("smooth", 6), "US+-": (12, EDGE), "uUu": (11, EDGE), "W": (EDGE, 3),
        "WS+-": (3, 5), "uUui": (10, EDGE), "TU+-": (EDGE, 2),
    },
    37.0: LARGE | {"US+-": (12, EDGE), "uUu": (11, EDGE), "WS+-": (3, 5), "uUui residual": (10, 14)},
    45.0: LARGE | {"US+-": (12, EDGE), "uUu": (11, EDGE)},
    55.0: LARGE | {"US+-": (12, EDGE), "uUu": (11, 15)},
    60.0: LARGE | {"US+-": (12, 17)},
}  # fmt: skip
SNAPS = {  # what the band leaves with a snap when the shear goes on, where the angle decides
    0.0: set(), 5.0: {5}, 15.0: {5}, 27.5: {4, 5}, 30.0: {5}, 37.0: {5}, 45.0: {3}, 55.0: {3}, 60.0: {3},
}  # fmt: skip


def end_of(end):
    """A number, or in words what a state ends at."""
    return end["number"] if end["number"] is not None else end["kind"]


@pytest.mark.parametrize("angle", ANGLES)
def test_states_and_their_ends_are_those_of_the_paper(angle):
    reference = REFERENCE[f"{angle:g}"]
    found = {}
    for s in reference["states"]:
        residual = s["name"] in found or (s["name"] == "uUui" and s["ends"][1]["number"] == 14)
        found[s["name"] + " residual" * residual] = tuple(end_of(e) for e in s["ends"])
    assert found == PAPER[angle]
    assert reference["warnings"] == []
    for s in reference["states"]:
        for e in s["ends"]:
            assert e["snap"] == (e["kind"] == "fold") or e["kind"] == "pitchfork"
            if e["number"] in (3, 4):
                assert e["snap"] == (e["number"] in SNAPS[angle] and s["name"] in ("U", "W"))
            if e["number"] in (9, 10, 11, 15):
                assert e["snap"]


def test_ranges_that_are_published():
    """The paper's and other programs' numbers, not ours."""
    at_15, at_0 = REFERENCE["15"]["events"], REFERENCE["0"]["events"]
    assert at_15["4"]["shear"] == pytest.approx(0.327675302, abs=1e-8)
    assert at_15["11"]["shear"] == pytest.approx(0.616372198, abs=1e-8)
    assert at_0["4"]["shear"] == pytest.approx(0.359236, abs=1e-6)
    assert at_0["11"]["shear"] == pytest.approx(0.603240, abs=1e-6)
    s = next(s for s in REFERENCE["0"]["states"] if s["name"] == "S+-")
    assert s["ends"][0]["shear"] == pytest.approx(0.53, abs=2e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_numbered_bifurcations_lie_on_their_loci(loci, angle):
    """And every locus that reaches an angle has its bifurcation in the slice."""
    events = REFERENCE[f"{angle:g}"]["events"]
    places = {}
    for piece in loci.pieces:
        low, high = piece.span
        if low - 1e-9 <= angle <= high and piece.number is not None:
            places[piece.number] = piece.at(max(angle, low + 1e-9))
    if angle == 0.0:  # fold 5 is born in the unfolding of the pitchfork at which US and WS meet in S
        s = next(s for s in REFERENCE["0"]["states"] if s["name"] == "S+-")
        born = loci.numbered(5).points[0]
        assert (born["dD"], born["height"]) == pytest.approx((s["ends"][0]["shear"], 0.0), abs=2e-4)
        del places[5]
    alone = {16, 17}  # they start from slices of their own
    assert set(places) - alone == {int(n) for n in events} - alone
    for number, (shear, height) in places.items():
        event = events[str(number)]
        assert shear == pytest.approx(event["shear"], abs=2e-4), number
        assert height == pytest.approx(event["height"], abs=6e-4 if (number, angle) == (7, 27.5) else 2e-4), number


def folds_at(loci, angle):
    """Places of all folds at an angle, numbered or not."""
    inside = (p for p in loci.pieces if p.kind == "fold" and p.span[0] <= angle <= p.span[1])
    return [p.at(angle) for p in inside]


def test_folds_of_closed_branches_lie_on_the_same_curves(loci):
    """16 on that of 13, 17 on that of 12; at 55 degrees US turns back at 0.856, beyond the slice."""
    for angle, number in ((55.0, 16), (60.0, 16), (60.0, 17)):
        event = REFERENCE[f"{angle:g}"]["events"][str(number)]
        near = min(folds_at(loci, angle), key=lambda place: abs(place[0] - event["shear"]))
        assert near == pytest.approx((event["shear"], event["height"]), abs=2e-4)
    assert max(shear for shear, _ in folds_at(loci, 55.0)) == pytest.approx(0.856, abs=5e-4)


def as_plain(slice_):
    """Names, ends and shears of the states, numbers and places of the bifurcations."""
    states = [
        (s.name, s.path, *((e.kind, e.number, e.snap) for e in (s.low, s.high))) for s in slice_.states
    ]  # fmt: skip
    shears = [x for s in slice_.states for x in s.span]
    places = {e.number: (e.value, e.response) for b in slice_.branches for e in b.events if e.number is not None}
    return states, shears, places


@pytest.mark.parametrize(
    "angle", [15.0, 30.0, *(pytest.param(angle, marks=pytest.mark.slow) for angle in (27.5, 60.0))]
)
def test_slices_are_as_recorded(angle, request):
    """At 27.5 degrees without what is carried over, at 60 without the search: nothing is missing there either."""
    if angle == 27.5:
        found = compute_slice(band_slice(angle, search=0), carry=False)
    else:
        found = request.getfixturevalue(f"slice_{angle:g}")
    states, shears, places = as_plain(found)
    reference = REFERENCE[f"{angle:g}"]
    ends = [[(e["kind"], e["number"], e["snap"]) for e in s["ends"]] for s in reference["states"]]
    assert states == [(s["name"], s["path"], *e) for s, e in zip(reference["states"], ends, strict=True)]
    assert shears == pytest.approx([e["shear"] for s in reference["states"] for e in s["ends"]], abs=2e-6)
    assert set(places) == {int(n) for n in reference["events"]}
    for number, place in places.items():
        event = reference["events"][str(number)]
        assert place == pytest.approx((event["shear"], event["height"]), abs=2e-6)
    closed = {b.id for b in found.branches if b.followed.branch.closed}
    us = next(s for s in found.states if s.name == "US+-")
    assert (us.branch in closed) == (angle == 60.0)
    assert found.warnings == ()
