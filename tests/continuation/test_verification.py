"""What was checked on a branch is on record, and what did not add up is looked at again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bvp_problems import algebraic, bratu, constant, elastica

from rodatlas.continuation import Branch, EndReason, MeshControl, Solution, Status, StepControl, TraceOptions, trace
from rodatlas.continuation.curve.point import first_frame
from rodatlas.continuation.curve.retrace import rechecked, suspicious
from rodatlas.continuation.results.verification import NEARLY_SINGULAR, ROUND_OFF, Discrepancy

COLUMN = TraceOptions(bounds={"P": (0.0, 100.0)})


@pytest.fixture(scope="module")
def column():
    return trace(elastica(), constant(elastica()), ("P", "V"), COLUMN, both=False)


def frame_of(branch, bvp, options):
    return first_frame(bvp, branch.points[0].solution, [bvp.parameter_index(n) for n in branch.free], options)[0]


def test_the_record_of_a_branch(column, tmp_path):
    record = column.verification
    assert (record.steps, record.indexed) == (len(column) - 1, 0)
    assert (record.converged, record.bracketed, record.untrusted) == (2, 0, ())
    assert record.complete
    assert record.least_singular == pytest.approx(np.nanmin(column.column("weakness")))
    assert "no index was given" in str(record)
    column.save(tmp_path / "b.h5")
    again = Branch.load(tmp_path / "b.h5")
    assert again.verification == record
    np.testing.assert_array_equal(again.column("weakness"), column.column("weakness"))


def test_the_index_is_counted():
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2)])
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, index=lambda s: int(s["lam"] > 0))
    branch = trace(bvp, constant(bvp, lam=-1.0), ("lam",), options, both=False)
    assert branch.verification.indexed == branch.verification.steps


def test_the_weakness_vanishes_at_a_branch_point():
    """It falls linearly in the distance: x (lam - x^2) on x = 0 is singular as |lam|."""
    bvp = algebraic(lambda u, p: [u.x * (p.lam - u.x**2)])
    options = TraceOptions(bounds={"lam": (-1.0, 1.0)}, step=StepControl(maximum=0.05))
    branch = trace(bvp, constant(bvp, lam=-1.0), ("lam",), options, both=False)
    lam, weakness = branch.column("lam"), branch.column("weakness")
    near = np.abs(lam) < 0.5
    np.testing.assert_allclose(weakness[near] / np.abs(lam[near]), (weakness / np.abs(lam))[near][0], rtol=0.2)


def test_a_suspicious_interval_is_cleared_by_a_second_look(column):
    """As if the walk had lost the second branch point and only said that something is wrong there."""
    lost = column.special[1]
    a = max(p.arclength for p in column.points if p.arclength < lost.arclength)
    b = min(p.arclength for p in column.points if p.arclength > lost.arclength)
    doubt = Discrepancy((a, b), (None, None), (), (80.0, 81.0), NEARLY_SINGULAR)
    wrong = replace(column, special=column.special[:1], discrepancies=(doubt,))
    assert len(suspicious(wrong)) == 1
    found = rechecked(wrong, frame_of(column, elastica(), COLUMN), COLUMN)
    assert found.discrepancies == ()
    assert [x.solution["P"] for x in found.special] == pytest.approx([x.solution["P"] for x in column.special])
    assert found.special[1].arclength == pytest.approx(lost.arclength, abs=1e-3)
    assert (found.verification.retraced, found.verification.cleared) == (1, 1)
    assert found.newton_iterations > column.newton_iterations


def test_a_bracketed_point_is_looked_at_again(column):
    vague = replace(column.special[0], status=Status.BRACKETED)
    wrong = replace(column, special=(vague, column.special[1]))
    found = rechecked(wrong, frame_of(column, elastica(), COLUMN), COLUMN)
    assert [x.status for x in found.special] == [Status.CONVERGED] * 2
    assert found.verification.complete


def test_a_change_of_sign_without_a_singular_value_is_no_branch_point(monkeypatch):
    """A determinant that flips by chance: no branch point is invented, and the interval is reported."""
    from rodatlas.continuation.curve.point import Frame

    honest = Frame.reached

    def flipping(self, state, fac, step):
        frame = honest(self, state, fac, step)
        wrong = float(frame.colloc.parameters(frame.x)[0]) > 1.0  # one side of lam = 1
        sign, log_det = frame.branch_test
        return replace(frame, branch_test=(-sign if wrong else sign, log_det))

    monkeypatch.setattr(Frame, "reached", flipping)
    options = TraceOptions(bounds={"lam": (0.0, 2.0)}, max_points=200)
    branch = trace(bratu(), constant(bratu()), ("lam",), options, both=False)
    assert branch.of_kind("branch point") == ()
    assert [d.reason for d in branch.discrepancies] == [ROUND_OFF]
    low, high = branch.discrepancies[0].parameter
    assert low < 1.0 < high
    assert not branch.verification.complete
    assert len(branch.verification.untrusted) == 1
    assert "round-off" in str(branch.discrepancies[0])


def test_a_mesh_that_falls_behind_is_refined_on_the_spot():
    """Von Karman's swirling flow from a uniform start: the first adaptation finds an error above any step."""
    import runpy
    from pathlib import Path

    module = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "auto_kar.py"))
    bvp = module["swirl"]()
    start = Solution.from_function(lambda s: np.zeros((len(s), bvp.size)), bvp.unknowns, bvp.parameters)
    options = TraceOptions(mesh=MeshControl(), bounds={"gamma": (0.0, 1.0)})
    branch = trace(bvp, start, ("gamma", "far"), options, both=False, direction=-1.0)
    assert branch.ends[1] is EndReason.RANGE
    assert branch.points[-1].solution["ddf0"] == pytest.approx(0.510232619, abs=1e-6)  # von Karman's flow
