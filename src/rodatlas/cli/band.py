"""`rodatlas band`: a real band in mm, converted; how exact that is, and whether the rod model fits it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from rodatlas import __version__
from rodatlas.cli.common import number, progress_bar
from rodatlas.cli.output import JsonTarget, json_text
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.experiments.real_band import BandReport


def run(
    dimensions: tuple[str, str, str], compression: str, poisson: str, material: tuple[str | None, str | None],
    angle: str, errors: tuple[str, str], json_to: JsonTarget,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    dimensions : length, width and thickness in mm.
    material : Young's modulus in GPa and density in kg/m^3; None where not known.
    errors : of the clamps, in degrees and mm.
    """
    from rodatlas.rods.band import Band, check_number
    from rodatlas.rods.units import BandUnits, ClampErrors

    names = ("length", "width", "thickness")
    length, width, thickness = (number(name, text) for name, text in zip(names, dimensions, strict=True))
    band = Band(length, width, thickness, number("poisson", poisson))
    young, density = (
        number(name, text) if text is not None else None
        for name, text in zip(("modulus", "density"), material, strict=True)
    )
    units = BandUnits(band, number("compression", compression), young, density)
    angle_error, displacement_error = errors
    clamps = ClampErrors(number("angle-error", angle_error), number("displacement-error", displacement_error))
    degrees = check_number("angle", number("angle", angle), 0.0, 89.999999, "degrees with 0 <= angle < 90")
    from rodatlas.atlas.experiments.real_band import band_report, check_errors

    check_errors(units, clamps)
    identity = {
        "rodatlas": __version__, "band": [length, width, thickness, band.poisson], "compression": units.compression,
        "modulus": young, "density": density, "angle_deg": degrees, "errors": [clamps.angle_deg, clamps.displacement],
    }  # fmt: skip
    json_to.expect(identity)
    with progress_bar(f"band at {degrees:g} deg") as tell:
        report = band_report(units, clamps, degrees, tell)
    say_table(Console(stderr=json_to.on_stdout), _table(report))
    json_to.write(json_text(report.to_json(), identity), identity)


def _table(report: BandReport) -> Table:
    from rodatlas.rods.band import limiting_shear

    u, band = report.units, report.units.band
    a = band.a / (3.0 * band.torsion_factor)
    rows = [
        ("band", f"{band.length:g} x {band.width:g} x {band.thickness:g} mm, nu = {band.poisson:g}"),
        ("D/L, D/t, D²/(tL)", f"{band.aspect:.6g}, {band.width / band.thickness:.4g}, {band.width_parameter:.4g}"),
        ("EI1/GJ", f"{band.a:.6g} of a thin band, as everywhere here; {a:.4g} of this rectangle"),
        ("compression", f"{u.compression:g} L = {u.to_mm(u.compression):.6g} mm"),
        ("limiting shear", f"{u.limit:.6f} L = {u.limit_mm:.3f} mm (no width: {limiting_shear(u.compression):.6f} L)"),
        ("1 mm", f"{u.from_mm(1.0):.7f} L = {u.from_mm(1.0) / u.limit:.7f} of the limiting shear"),
        *_mechanical(report),
        *_errors(report),
        *_width(report),
    ]  # fmt: skip
    table = Table(show_header=False)
    for row in rows:
        table.add_row(*row)
    return table


def _mechanical(report: BandReport) -> list[tuple[str, str]]:
    """Units of force and moment, when Young's modulus is known."""
    u = report.units
    if u.young is None:
        rows = [("force, moment", "need --modulus (Young's, in GPa)")]
        return rows if u.density is None else [*rows, ("weight", f"{u.weight_newton:.4g} N")]
    rows = [
        ("GJ", f"{u.twisting_stiffness:.5g} N mm²"),
        ("force GJ/L²", f"{u.force:.5g} N"),
        ("moment GJ/L", f"{u.moment:.5g} N mm; energy {u.moment:.5g} mJ"),
    ]
    if u.density is not None:
        part = u.weight / report.checks[0].force
        rows.append(("weight", f"{u.weight:.4g} GJ/L² = {u.weight_newton:.4g} N, {part:.0%} of the force in U at rest; "
                     f"the model here has none"))  # fmt: skip
    return rows


def _errors(report: BandReport) -> list[tuple[str, str]]:
    """What clamps set a little wrong do to measured shears."""
    u, e = report.units, report.errors
    rows = [
        (f"clamps within {e.displacement:g} mm", f"shear ± {e.of_shear(u):.4f} L, limiting shear ± {e.of_limit(u):.4f} "
         f"L, their ratio near 1 ± {e.of_normalized(u, u.limit):.4f}"),
    ]  # fmt: skip
    at = f"U at {report.angle_deg:g} deg"
    if report.bifurcation is None:
        return [*rows, (at, "does not bifurcate below 0.94 of the limiting shear")]
    rows += [(at, f"bifurcates at shear {report.bifurcation:.5f} L = {u.to_mm(report.bifurcation):.2f} mm")]
    if report.slopes is not None and report.bifurcation_error is not None:
        rows += [
            (f"with {e.angle_deg:g} deg, {e.displacement:g} mm", f"± {report.bifurcation_error:.4f} L "
             f"({report.slopes.angle:+.4f} L for a degree, {report.slopes.compression:+.3f} L for dL = 1)"),
        ]  # fmt: skip
    return rows


def _width(report: BandReport) -> list[tuple[str, str]]:
    """What the width would add, and the verdict."""
    rows = [
        (f"U, shear {c.shear:.4f}", f"width adds {f'{c.added:.2%}' if c.added < 1 else 'more than 100%'} of the energy;"
         f" largest strain {c.strain:.2%}")
        for c in report.checks
    ]  # fmt: skip
    return [*rows, ("narrow-band model", f"expected: {report.verdict}")]
