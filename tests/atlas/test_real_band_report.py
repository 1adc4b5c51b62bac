"""What clamps set a little wrong do to a bifurcation, and the report on a real band."""

import math

import numpy as np
import pytest

from rodatlas.atlas.experiments.real_band import band_report
from rodatlas.atlas.experiments.sensitivity import sensitivity
from rodatlas.continuation import TraceOptions, trace
from rodatlas.rods import Band, BandUnits, ClampErrors, Ends, rod_problem, state_at


def first_event(angle_deg, compression, family="U", upper=0.5):
    bounds = {"dD": (0.0, upper)}
    options = TraceOptions(bounds=bounds, stop_at=lambda special, last: True)
    start = state_at(Ends(angle_deg, compression), family)
    return trace(rod_problem(), start, ("dD",), options, both=False).special[0]


def shear_of(*setting):
    return first_event(*setting).solution["dD"]


def test_slopes_against_differences():
    """Of the pitchfork of U at 15 degrees, from pitchforks at neighboring angles and compressions."""
    slopes = sensitivity(first_event(15.0, 0.5))
    assert slopes.angle == pytest.approx((shear_of(15.1, 0.5) - shear_of(14.9, 0.5)) / 0.2, rel=1e-4)
    assert slopes.compression == pytest.approx((shear_of(15.0, 0.501) - shear_of(15.0, 0.499)) / 0.002, rel=1e-4)


def test_slopes_of_a_fold(slice_15):
    """Fold 5 at 15 degrees; the difference is of loci computed elsewhere in the tests to 0.05 degrees."""
    fold = next(e for b in slice_15.branches for e in b.events if e.number == 5)
    slopes = sensitivity(fold.special)
    assert slopes.angle == pytest.approx(-0.0037837, rel=1e-3)
    assert slopes.compression > 0


def test_report_on_the_narrow_band():
    units = BandUnits(Band(240.0, 3.0, 0.127), young=4.5)
    report = band_report(units, ClampErrors(1.0, 0.5))
    assert report.bifurcation == pytest.approx(0.327675302, abs=1e-7)
    moved = 0.5 / 240.0
    expected = math.hypot(report.slopes.angle, report.slopes.compression * moved, moved)
    assert report.bifurcation_error == pytest.approx(expected, rel=1e-12)
    assert report.bifurcation_error < 0.01  # the scatter of the experiments
    assert report.verdict == "holds"
    assert [c.shear for c in report.checks] == [0.0, 0.5 * units.limit]
    plain = report.to_json()
    assert plain["limiting_shear_mm"] == pytest.approx(204.868, abs=1e-3)
    assert plain["moment_Nmm"] == pytest.approx(plain["force_N"] * 240.0)


def test_the_rod_does_not_fit_a_wide_band():
    report = band_report(BandUnits(Band(240.0, 30.0, 0.127)), ClampErrors(0.0, 0.0))
    assert report.verdict == "does not hold"
    assert report.bifurcation_error == 0.0
    # at rest the plate bends cylindrically in the limit of a wide band: 1/(1 - nu^2) of the beam, that is 6.7% more
    wide = band_report(BandUnits(Band(240.0, 240.0, 0.0005)), ClampErrors())
    assert wide.checks[0].added == pytest.approx(1 / (1 - 0.25**2) - 1, rel=0.02)
    assert np.isfinite(wide.checks[1].added)
