"""What the paper says in words, and the clamp condition that it misprints."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from rodatlas.atlas import compute_slice
from rodatlas.continuation import EndReason, TraceOptions, follow_locus, trace
from rodatlas.paper.model import band_slice
from rodatlas.rods import Ends, RodState, limiting_shear, planar_states, rod_problem, state_at
from rodatlas.rods.stability import morse_index_of

REFERENCE = json.loads((Path(__file__).parent / "slices.json").read_text())["slices"]


def clamped_elastica(chord):
    """Thrust over EI and mid-height of the first mode with clamps in line, from the closed form.

    Four quarter waves of modulus k: chord = 2 E(k)/K(k) - 1, thrust (4 K)^2, height 2 amplitudes = 4 k / (4 K).
    """
    m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - chord, 1e-9, 0.999)
    return (4 * ellipk(m)) ** 2, math.sqrt(m) / ellipk(m)


@pytest.mark.parametrize("compression", [0.05, 0.3, 0.5, 0.7])
def test_the_ends_are_one_minus_the_compression_apart(compression):
    """The paper prints x(1) = dL at the right clamp, which is right at dL = 1/2 only."""
    thrust, height = clamped_elastica(1.0 - compression)
    if compression == 0.5:
        assert (thrust, height) == pytest.approx((53.274112596, 0.373306427), abs=1e-8)
    u = RodState(planar_states(0.625, 0.0, compression)[0]["U"])
    assert u.position[-1] == pytest.approx((1.0 - compression, 0.0, 0.0), abs=1e-9)
    assert -u.tension[0] / 0.625 == pytest.approx(thrust, rel=1e-7)
    assert np.max(u.solution(0.5, "y")) == pytest.approx(height, abs=1e-8)
    misprinted = clamped_elastica(compression)[0]
    assert (abs(misprinted / thrust - 1) < 1e-9) == (compression == 0.5)
    if compression == 0.05:  # a band that is hardly compressed carries hardly more than the Euler load
        assert thrust == pytest.approx(4 * math.pi**2, rel=0.03)
        assert misprinted > 1.9 * thrust


def u_branch(angle, compression=0.5, highest=0.86):
    """The branch of U from shear zero."""
    options = TraceOptions(bounds={"dD": (0.0, highest)}, index=morse_index_of, max_folds=0)
    return trace(rod_problem(), state_at(Ends(angle, compression)), ("dD",), options, both=False)


@pytest.mark.slow
def test_from_31_degrees_on_u_leads_to_the_limiting_shear_without_a_snap():
    """U, w and uUui are one stable branch; below 30.6 degrees it ends at fold 6."""
    path = u_branch(31.0)
    assert path.special == ()
    assert path.ends[1] is EndReason.RANGE
    assert {p.index for p in path.points} == {0}
    assert 0 < path.points[-1].solution["height"] < 0.01
    blocked = u_branch(30.5)
    (fold,) = blocked.special
    assert fold.kind == "fold"
    assert fold.solution["dD"] == pytest.approx(0.638, abs=5e-3)


@pytest.mark.slow
def test_a_larger_angle_leaves_fewer_states():
    """Only U-w-uUui is left above 77 degrees."""
    names = [{s["name"] for s in REFERENCE[key]["states"]} for key in ("5", "15", "27.5", "30", "37", "45", "55", "60")]
    for low, high in pairwise(names):
        assert high <= low
    found = compute_slice(band_slice(78.0))
    assert found.warnings == ()  # a search finds none either
    assert [(s.name, s.path) for s in found.states] == [(name, "U-w-uUui") for name in ("U", "w", "uUui")]


def test_a_larger_poisson_ratio_widens_the_range_of_twisted_states(slice_15):
    """From nu = 0 to 1/2 at 15 degrees; 0, 1 and 2 move further than the other bifurcations."""
    events = {e.number: e for b in slice_15.branches for e in b.events if e.number is not None}
    stiffness = {"a": (0.5, 0.75)}
    moved = {}
    for number in (0, 1, 2, 3, 4, 5, 6, 10, 11):
        options = TraceOptions(bounds={"dD": (-0.1, 0.8), **stiffness})
        locus = follow_locus(rod_problem(), events[number].special, ("dD", "a"), options)
        a, shear = (np.array([p.solution[name] for p in locus.points]) for name in ("a", "dD"))
        order = np.argsort(a)
        if number in (1, 2):
            assert np.all(np.diff(shear[order]) > 0)
        moved[number] = abs(np.interp(0.74, a[order], shear[order]) - np.interp(0.6, a[order], shear[order]))
    assert min(moved[n] for n in (0, 1, 2)) > max(moved[n] for n in moved if n > 2)


@pytest.mark.slow
@pytest.mark.parametrize("compression", [0.3, 0.7])
def test_other_compressions_have_the_same_u_branch(compression):
    """Both pitchforks scale roughly with the limiting shear, toward which the height goes to zero."""
    limit = limiting_shear(compression)
    branch = u_branch(15.0, compression, 0.99 * limit)
    assert branch.ends[1] is EndReason.RANGE
    assert [x.kind for x in branch.special] == ["branch point"] * 2
    assert [x.breaks for x in branch.special] == [("reversal",)] * 2
    assert [x.index for x in branch.special] == [(0, 1), (1, 0)]
    parts = [x.solution["dD"] / limit for x in branch.special]
    assert parts == pytest.approx([0.378, 0.712], abs=0.1)  # those at dL = 1/2
    heights = branch.column("height")
    assert np.all(np.diff(heights) < 0)
    assert heights[-1] < 0.06 * heights[0]
