"""The table of special points in the documentation holds what the program computes."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs/atlas/phase.md"
ROW = re.compile(r"^\| (\d+\.\d{4}) \| (-?\d\.\d{6}) \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


@pytest.fixture(scope="module")
def rows():
    block = re.search(r"<!-- events -->(.*?)<!-- end of events -->", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return [(float(a), float(d), tuple(n.split(", ")), told) for a, d, n, told in ROW.findall(block[1])]


def test_every_computed_event_is_in_the_table(loci, rows):
    events = [e for e in loci.events() if e.parameter != "shear"]
    assert len(events) > 20
    for e in events:
        near = [r for r in rows if abs(r[0] - e.second) < 1e-3 and abs(r[1] - e.value) < 1e-5]
        assert len(near) == 1, e
        if not {"16", "17"} & {n.rstrip("'") for n in near[0][2]}:  # they have a number from slices of their own only
            assert near[0][2] == e.labels


def test_the_table_holds_nothing_else(loci, rows):
    assert len(rows) == len([e for e in loci.events() if e.parameter != "shear"])
    assert [r[0] for r in rows] == sorted(r[0] for r in rows)
