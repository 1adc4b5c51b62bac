"""Special points of the loci as events of the plane: each once, in order, with what happens in words."""

import pytest

# the paper's events and their neighbors: angle [deg], loci, what happens
TOLD = [
    (0.135, "6 7", "w is born: folds 6 and 7 meet in a cusp"),
    (26.2916, "4 12", "pitchfork 4 turns subcritical: fold 12 (US+-) is born"),
    (26.892, "1 1'", "TW+- vanishes: fold 1 and its mirror image annihilate in a cusp"),
    (27.5096, "7 9", "fold 7 passes pitchfork 9"),
    (27.71, "13 18", "two branches touch: folds 13 and 18 are born"),
    (27.7455, "7 18", "folds 7 and 18 annihilate in a cusp"),
    (28.147, "4 9", "U joins w: pitchforks 4 and 9 annihilate"),
    (30.62, "6' 14", "two branches touch: folds 6' and 14 are born"),
    (30.6346, "6 6'", "folds 6 and 6' annihilate in a cusp"),
    (41.7449, "3 5", "pitchfork 3 turns subcritical: fold 5 (WS+-) vanishes"),
    (44.1702, "10 14", "fold 14 passes pitchfork 10"),
    (44.266, "8 10", "pitchforks 8 and 10 annihilate"),
    (56.293, "11 15", "uUu is no longer stable: pitchforks 11 and 15 annihilate"),
    (74.0265, "2 2'", "TU+- vanishes: fold 2 and its mirror image annihilate"),
    (76.9499, "3 3'", "W is no longer stable: pitchfork 3 and its mirror image annihilate"),
]


@pytest.mark.parametrize(("angle", "labels", "description"), TOLD, ids=[f"{t[0]:g}" for t in TOLD])
def test_each_event_once(loci, angle, labels, description):
    found = [e for e in loci.events() if e.parameter != "shear" and set(e.labels) == set(labels.split())]
    near = [e for e in found if abs(e.second - angle) < 0.002]
    assert [e.description for e in near] == [description]
    assert near[0].status == "converged"


def test_events_are_in_order_and_apart(loci):
    events = loci.events()
    assert [e.second for e in events] == sorted(e.second for e in events)
    places = [(e.second, e.value, e.response, e.parameter) for e in events]
    for i, one in enumerate(places):
        for two in places[:i]:
            same = max(abs(a - b) for a, b in zip(one[:3], two[:3], strict=True)) < 1e-4
            assert not same or (one[3] == "shear") != (two[3] == "shear")


def test_extrema_in_shear_tell_their_side(loci):
    """Seen on the computed points around: fold 2 has its largest shear, pitchfork 4 its smallest."""
    told = {e.labels: (e, e.description) for e in loci.events() if e.parameter == "shear"}
    highest, said = told[("2",)]
    assert said == "fold 2 reaches its largest shear"
    assert highest.value == pytest.approx(max(p["dD"] for p in loci.numbered(2).points), abs=1e-3)
    assert highest.value >= max(p["dD"] for p in loci.numbered(2).points)
    lowest, said = told[("4",)]
    assert said == "pitchfork 4 reaches its smallest shear"
    assert lowest.value <= min(p["dD"] for p in loci.numbered(4).points)


def test_descriptions_in_tables(loci):
    found = loci.to_json((4,))
    assert [e["description"] for e in found["events"] if e["parameter"] != "shear"] == [
        "pitchfork 4 turns subcritical: fold 12 (US+-) is born", "U joins w: pitchforks 4 and 9 annihilate",
    ]  # fmt: skip
    of_locus = {e["description"] for e in found["loci"][0]["events"]}
    assert of_locus == {e["description"] for e in found["events"]}
    frame = loci.to_frame()
    assert set(frame.loc[frame["number"] == 7, "description"]) >= {"fold 7 passes pitchfork 9"}
