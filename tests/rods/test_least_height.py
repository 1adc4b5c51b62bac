"""The band's height where it is least, along a branch and in the plane of clamp angle and shear."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from rodatlas.continuation import Status, TraceOptions, follow_locus, sensitivity, solve, trace
from rodatlas.rods import Ends, rod_problem, state_at

PLANE = ("dD", "psi0")


@pytest.fixture(scope="module")
def least():
    options = TraceOptions(bounds={"dD": (0.0, 0.55)}, extrema=("height",))
    branch = trace(rod_problem(), state_at(Ends(15.0), "third mode"), ("dD",), options, both=False)
    point = max(branch.of_kind("extremum of height"), key=lambda x: x.solution["dD"])
    before = [p.solution for p in branch.points if p.arclength < point.arclength]
    return point, before[-1]


def test_the_least_height_of_w(least):
    """Golden section over solutions at fixed shear finds the same."""
    point, near = least
    assert (point.status, point.normal_form.kind) == (Status.CONVERGED, "minimum")
    found = minimize_scalar(
        lambda d: solve(rod_problem(), near.with_parameters(dD=d), ("dD",))["height"], bracket=(0.51, 0.53, 0.55)
    )
    assert point.solution["height"] == pytest.approx(found.fun, abs=1e-9)
    assert point.solution["dD"] == pytest.approx(found.x, abs=1e-6)


def test_its_locus_passes_the_place_where_branches_merge(least):
    """There the shear's own fold locus turns back, too: 30.62 degrees."""
    point, _ = least
    options = TraceOptions(bounds={"dD": (0.0, 0.75), "psi0": (0.0, np.radians(40.0))}, within=("reversal",))
    locus = follow_locus(rod_problem(), point, PLANE, options)
    (merge,) = (e for e in locus.events if e.parameter == "psi0")
    assert np.degrees(merge.solution["psi0"]) == pytest.approx(30.6200, abs=0.002)
    assert merge.what == "two branches touch: they merge and split"
    (saddle,) = (e for e in locus.events if e.parameter == "height")
    assert saddle.what == "height is stationary in dD and psi0: a saddle"
    start = next(p for p in locus.points if p.arclength == 0.0)
    slope = sensitivity(rod_problem(), point)["psi0"]
    assert slope == pytest.approx(start.tangent[0] / start.tangent[1], rel=1e-5)
