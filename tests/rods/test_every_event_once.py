"""Nothing missed, nothing spurious: lists of bifurcations do not depend on the steps, up to large forces."""

from dataclasses import replace

import pytest

from rodatlas.continuation import EndReason, Status, StepControl, TraceOptions, trace
from rodatlas.rods import Ends, rod_problem, state_at
from rodatlas.rods.stability import morse_index_of

pytestmark = pytest.mark.slow

# angle, family, largest shear, whether the index is computed -> kinds and shears (found with three step sizes, and
# those of U at 15 degrees published)
LISTS = {
    (0.0, "U", 0.85): [("branch point", 0.359236), ("branch point", 0.603240)],
    (15.0, "U", 0.85): [("branch point", 0.327675), ("branch point", 0.616372)],
    (45.0, "U", 0.85): [],
    (15.0, "third mode", 0.75): [
        ("branch point", 0.361867), ("branch point", 0.470329), ("fold", 0.579102), ("fold", 0.503295),
        ("branch point", 0.509330),
    ],
    (55.0, "W", 0.85): [("branch point", 0.304546), ("fold", 0.476303), ("branch point", 0.378492)],
}  # fmt: skip


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("place", LISTS, ids=str)
def test_lists(place, factor):
    angle, family, high = place
    control = StepControl(maximum=20.0)
    control = replace(
        control, initial=control.initial * factor, maximum=control.maximum * factor, target=control.target * factor**3
    )
    index = morse_index_of if factor == 1.0 else None
    options = TraceOptions(bounds={"dD": (-0.05, high)}, step=control, index=index)
    branch = trace(rod_problem(), state_at(Ends(angle), family), ("dD",), options)
    assert branch.ends == (EndReason.RANGE, EndReason.RANGE)
    assert not branch.discrepancies
    assert all(x.status is Status.CONVERGED for x in branch.special)
    assert [x.kind for x in branch.special] == [kind for kind, _ in LISTS[place]]
    shears = [x.solution["dD"] for x in branch.special]
    assert shears == pytest.approx([shear for _, shear in LISTS[place]], abs=1e-6)
