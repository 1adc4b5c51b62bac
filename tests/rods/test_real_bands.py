"""Bands in millimeters: limiting shear, units of force, torsion of a rectangle, and what the width adds."""

import math

import numpy as np
import pytest

from rodatlas.rods import Band, BandUnits, ClampErrors, Ends, limiting_shear, state_at, width_effect
from rodatlas.rods.band import torsion_factor
from rodatlas.rods.width import width_energy, width_function


@pytest.mark.parametrize(
    ("width", "expected"), [(240e-8, 0.866025), (3.0, 0.853616), (30.0, 0.75), (60.0, 0.651388)]
)  # the values that the paper's bands have
def test_limiting_shear_of_real_bands(width, expected):
    units = BandUnits(Band(240.0, width, min(width, 0.127)))
    assert units.limit == pytest.approx(expected, abs=5e-7)
    assert units.limit_mm == pytest.approx(240.0 * expected, abs=2e-4)


def test_at_the_limiting_shear_a_diagonal_is_straight():
    """Opposite corners of the flat band are sqrt(L^2 + D^2) apart, and so are those of the clamps."""
    for compression, width in ((0.5, 30.0), (0.2, 60.0), (0.9, 3.0)):
        units = BandUnits(Band(240.0, width, 0.127), compression)
        apart = math.hypot(240.0 * (1.0 - compression), units.limit_mm + width)
        assert apart == pytest.approx(math.hypot(240.0, width), rel=1e-12)


def test_millimeters_there_and_back():
    units = BandUnits(Band(240.0, 3.0, 0.127))
    assert units.from_mm(120.0) == 0.5
    assert units.to_mm(units.from_mm(33.3)) == pytest.approx(33.3, rel=1e-15)


@pytest.mark.parametrize(("ratio", "expected"), [(1.0, 0.1406), (2.0, 0.229), (4.0, 0.281), (10.0, 0.312)])
def test_torsion_factor_against_the_table_of_timoshenko(ratio, expected):
    assert torsion_factor(ratio) == pytest.approx(expected, abs=6e-4)


def test_torsion_does_not_depend_on_which_side_is_the_width():
    for ratio in (1.5, 3.0, 7.0):  # D t^3 lambda(D/t) = t D^3 lambda(t/D)
        assert torsion_factor(1.0 / ratio) == pytest.approx(torsion_factor(ratio) / ratio**2, rel=1e-7)


def test_torsion_of_a_thin_band():
    assert torsion_factor(1e9) == pytest.approx(1 / 3, abs=1e-9)
    assert torsion_factor(20.0) == pytest.approx((1 - 0.6302 / 20) / 3, abs=1e-5)


def test_units_of_force_and_moment_agree_with_the_bending_stiffness():
    """a GJ = EI1 = Y D t^3/12, by another way than through GJ."""
    for poisson in (0.0, 0.25, 0.5):
        band = Band(240.0, 60.0, 0.127, poisson)
        units = BandUnits(band, 0.5, young=4.5)
        a = (1.0 + poisson) / (6.0 * band.torsion_factor)
        bending = 4500.0 * 60.0 * 0.127**3 / 12.0
        assert a * units.twisting_stiffness == pytest.approx(bending, rel=1e-12)
        assert units.force * 240.0 == pytest.approx(units.moment, rel=1e-12)
        assert a == pytest.approx(band.a, rel=2e-3)


def test_euler_load_in_newtons():
    """A clamped strip of 240 x 60 x 0.127 mm and 4.5 GPa buckles at 4 pi^2 EI/L^2 = 0.0316 N."""
    units = BandUnits(Band(240.0, 60.0, 0.127), young=4.5)
    load = 39.478417604 * (0.625 / (3 * units.band.torsion_factor))  # in GJ/L^2
    assert load * units.force == pytest.approx(4 * math.pi**2 * 4500 * 60 * 0.127**3 / 12 / 240**2, rel=1e-9)


def test_weight_of_a_polyester_band():
    """1390 kg/m^3: 240 x 3 x 0.127 mm weigh 0.127 g; as a force of the program rho g L^3/(lambda mu t^2)."""
    band = Band(240.0, 3.0, 0.127)
    units = BandUnits(band, young=4.5, density=1390.0)
    assert units.weight_newton == pytest.approx(0.1271e-3 * 9.80665, rel=1e-4)
    shear_modulus = 4.5e9 / 2.5
    thin = 1390.0 * 9.80665 * 0.24**3 / (band.torsion_factor * shear_modulus * 0.127e-3**2)
    assert units.weight == pytest.approx(thin, rel=1e-12)
    assert BandUnits(Band(240.0, 60.0, 0.127), young=4.5, density=1390.0).weight == pytest.approx(thin, rel=0.03)
    with pytest.raises(ValueError, match=r"^density: expected kg/m\^3"):
        _ = BandUnits(band, young=4.5).weight


def test_forces_need_a_modulus():
    with pytest.raises(ValueError, match=r"^modulus: expected Young's modulus in GPa"):
        _ = BandUnits(Band()).force


@pytest.mark.parametrize("text", ["240x3", "240x3x0.127x1", "axbxc", "", "240,3,0.127"])
def test_a_band_from_wrong_text(text):
    with pytest.raises(ValueError, match=rf"^band: expected LENGTHxWIDTHxTHICKNESS in mm .* got '{text}'"):
        Band.from_text(text)


@pytest.mark.parametrize(
    ("text", "field"),
    [("240x500x0.127", "width"), ("240x3x5", "thickness"), ("240x3x1e-300", "thickness"), ("1e300x3x0.127", "length"),
     ("240x1e-12x1e-12", "width")],
)  # fmt: skip
def test_a_band_is_longer_than_wide_and_wider_than_thick(text, field):
    with pytest.raises(ValueError, match=f"^band {field}: expected a positive length from "):
        Band.from_text(text)
    square = Band(1.0, 1.0, 1.0)  # the bounds themselves are right
    assert square.aspect == square.width_parameter == 1.0


@pytest.mark.parametrize(
    ("material", "field"),
    [({"young": 1e308}, "modulus"), ({"young": 1e-300}, "modulus"), ({"density": 1e308}, "density"),
     ({"density": 0.0}, "density"), ({"compression": 1e-300}, "compression"), ({"compression": 1.0}, "compression"),
     ({"young": 10**400}, "modulus")],
)  # fmt: skip
def test_units_of_what_is_no_material(material, field):
    with pytest.raises(ValueError, match=f"^{field}: expected a "):
        BandUnits(Band(), **material)


def test_a_band_from_text():
    assert Band.from_text("240x3x0.127") == Band.from_text("240 X 3 × 0.127 mm") == Band(240.0, 3.0, 0.127)
    assert Band.from_text("240x30x0.127").width_parameter == pytest.approx(29.5, abs=0.05)
    with pytest.raises(ValueError, match=r"^band width: expected a positive length from .*, got -3"):
        Band.from_text("240x-3x0.127")


def test_error_of_the_limiting_shear_is_its_derivative():
    units, errors, h = BandUnits(Band(240.0, 30.0, 0.127), 0.4), ClampErrors(1.0, 0.5), 1e-6
    slope = (limiting_shear(0.4 + h, 0.125) - limiting_shear(0.4 - h, 0.125)) / (2 * h)
    assert errors.of_limit(units) == pytest.approx(slope * 0.5 / 240.0, rel=1e-8)
    assert errors.of_normalized(units, 0.0) == pytest.approx(0.5 / 240.0 / units.limit, rel=1e-12)


def test_width_function_is_that_of_the_formula():
    mu = np.linspace(0.05, 6.0, 400)
    plain = 1 - (np.cosh(2 * mu) - np.cos(2 * mu)) / (mu * (np.sinh(2 * mu) + np.sin(2 * mu)))
    assert width_function(mu) == pytest.approx(plain, abs=2e-10)
    assert width_function(np.array([1e3])) == pytest.approx([1 - 1e-3], rel=1e-12)
    small = np.array([1e-3, 1e-2])
    assert width_function(small) == pytest.approx(4 / 45 * small**4, rel=1e-6)


def test_width_energy_at_an_inflection_has_a_limit():
    """As kappa vanishes: tau^4 beta^2 (1 + nu)/240."""
    at_zero, near = width_energy(np.array([0.0, 1e-5]), np.array([3.0, 3.0]), 0.3, 0.25)
    assert at_zero == pytest.approx(near, rel=1e-6)
    assert at_zero == pytest.approx(81.0 * 0.09 * 1.25 / 240.0, rel=1e-6)


def test_width_effect_against_the_ribbon_model():
    """Audoly-Neukirch ribbon, beta = 0.295, 45 degrees, dD = 0.2: E = 8.312621 against 8.272356559 of the rod."""
    solution = state_at(Ends(45.0, 0.5, 0.2))
    thickness = 9.0 / (0.295 * 240.0)
    effect = width_effect(solution, Band(240.0, 3.0, thickness))
    assert effect == pytest.approx((8.312621 - 8.272356559) / 8.272356559, rel=5e-3)
    long, longer = (width_effect(solution, Band(k * 240.0, 3.0, thickness)) for k in (100.0, 1000.0))
    assert longer == pytest.approx(long / 100.0, rel=1e-3)  # the first power of beta^2
