"""The commands and their options; what each does lies in a module of its own."""

from __future__ import annotations

import os
from functools import partial
from typing import Annotated

import typer

from rodatlas import __version__
from rodatlas.cli.command import CONTEXT, Command, Group, argument, flag, given, option
from rodatlas.cli.controls import ModelCommand, fixed_in
from rodatlas.cli.output import json_target

ENDINGS = """\b
Exit codes:
  0    done
  1    the computation failed, or not all of it succeeded; what is finished is kept
  2    wrong input, or a file that cannot be read or written: one line says which
  70   a fault of the program; RODATLAS_TRACEBACK=1 in the environment shows where
  130  interrupted; what is finished is kept, and the same command goes on
"""

app = typer.Typer(
    cls=Group,
    help="Equilibria, stability and bifurcations of clamped elastic bands.",
    no_args_is_help=False,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # it takes brackets, in which defaults stand, for markup
    context_settings=CONTEXT,
    epilog=ENDINGS,
)
command = partial(app.command, cls=Command, context_settings=CONTEXT)
model_command = partial(app.command, cls=ModelCommand, context_settings=CONTEXT)

Shear = Annotated[str, option("--shear", kind="NUMBER", help="Shear dD.")]
COMPRESSION = "dL, between 0 and 1; the ends are 1 - dL apart along x."
POISSON = "Poisson's ratio of the band, -1 < nu <= 0.5."
Compression = Annotated[str, option(kind="NUMBER", help=COMPRESSION)]
Poisson = Annotated[str, option(kind="NUMBER", help=POISSON)]
In = Annotated[
    str | None,
    option("--in", kind="NAME", help="Two controls such as compression,shear.", default="for the band angle,shear"),
]
AnyAngle = Annotated[
    str | None,
    option("--angle", kind="DEGREES", help="Clamp angle psi0, -180 to 180.", default="one for each clamp"),
]
AngleLeft = Annotated[
    str | None,
    option("--angle-left", kind="DEGREES", help="Angle at which the band leaves the left clamp.", default="psi0"),
]
AngleRight = Annotated[
    str | None,
    option(
        "--angle-right", kind="DEGREES", help="Angle at which it arrives at the right one, downward.",
        default="psi0",
    ),
]  # fmt: skip
OFFSET = "dY, by which the right clamp lies higher along y."
TWIST = "Turn of the right clamp about its tangent, -720 to 720."
Offset = Annotated[str, option("--offset", kind="NUMBER", help=OFFSET)]
Twist = Annotated[str, option("--twist", kind="DEGREES", help=TWIST)]
Tolerance = Annotated[
    str, option("--tol", kind="NUMBER", help="Largest error at mesh points, relative to each unknown, 1e-10 to 1e-6.")
]
Out = Annotated[str, option("--out", kind="FOLDER", help="Folder for figures and data.")]
Fresh = Annotated[bool, flag("--fresh", help="Compute everything again, even what the folder has.")]
Json = Annotated[
    str | None, option("--json", kind="FILE", help="Write the result as JSON to a file too, or to -.", default="none")
]
Overwrite = Annotated[bool, flag("--overwrite", help="Replace files named here that hold another result.")]
Processes = Annotated[
    str | None,
    option(
        "--workers", kind="INTEGER", help="Processes on this machine.", default=f"one per processor, {os.cpu_count()}"
    ),
]


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, flag("--version", help="Print the version and exit.")] = False,
) -> None:
    """Equilibria, stability and bifurcations of clamped elastic bands."""
    if version:
        print(__version__)
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


@model_command("slice")
def slice_command(
    context: typer.Context,
    along: Annotated[
        str | None, option(kind="NAME", help="Control that varies: compression, angle ..", default="for the band shear")
    ] = None,
    low: Annotated[
        str | None, option("--from", kind="NUMBER", help="Least value of what varies.", default="usual for it")
    ] = None,
    high: Annotated[
        str | None, option("--to", kind="NUMBER", help="Largest value of what varies.", default="usual for it")
    ] = None,
    against: Annotated[
        str | None,
        option(kind="NAME", help="Quantity that is shown: energy, force-x ..", default="for the band height"),
    ] = None,
    shear_max: Annotated[
        str | None, option(kind="NUMBER", help="Largest shear dD.", default="0.9469 of the limiting shear")
    ] = None,
    shear_min: Annotated[
        str | None, option(kind="NUMBER", help="Least shear, 0 or below.", default="-0.0577 of the limiting shear")
    ] = None,
    search: Annotated[
        str,
        option(kind="INTEGER", help="Starts of the search for isolated stable states at each of six places; 0: none."),
    ] = "256",
    tol: Tolerance = "1e-8",
    out: Out = "out",
    fresh: Fresh = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
    overlay: Annotated[
        str | None, option(kind="FILE", help="CSV of measured ranges (state, shear_min, shear_max ..).", default="none")
    ] = None,
    band: Annotated[
        str | None,
        option(kind="LxWxT", help="Band in mm behind --overlay, such as 240x3x0.127.", default="as the file says"),
    ] = None,
) -> None:
    """Follow all equilibria at one setting as a control varies, the shear by default: table, figures and data."""
    from rodatlas.cli.setting import Range
    from rodatlas.cli.slice import run

    where = Range(along, low, high, against, shear_max, shear_min)
    run(fixed_in(context), where, tol, search, out, json_target(json_to, overwrite), fresh, overlay, band)


@model_command("loci")
def loci_command(
    context: typer.Context,
    number: Annotated[
        list[str] | None,
        option("--number", kind="INTEGER", help="Number of a bifurcation, 0 to 18; may be repeated.", default="all"),
    ] = None,
    everything: Annotated[bool, flag("--all", help="All that have numbers, the default.")] = False,
    where: In = None,
    angle_max: Annotated[
        str | None, option("--angle-max", kind="DEGREES", help="Largest clamp angle, 15 to below 90.", default="80")
    ] = None,
    tol: Tolerance = "1e-8",
    out: Out = "out",
    fresh: Fresh = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Follow numbered bifurcations in two controls, clamp angle and shear by default: special points, figure, data."""
    from rodatlas.cli.loci import run

    if everything and number:
        raise ValueError("all: expected no --number beside --all, got one")
    run(number or [], fixed_in(context), where, angle_max, tol, out, json_target(json_to, overwrite), fresh)


@model_command("phase")
def phase_command(
    context: typer.Context,
    where: In = None,
    angle_min: Annotated[
        str | None, option("--angle-min", kind="DEGREES", help="Smallest clamp angle, 0 to 89.", default="0")
    ] = None,
    angle_max: Annotated[
        str | None, option("--angle-max", kind="DEGREES", help="Largest clamp angle, below 90.", default="80")
    ] = None,
    tol: Tolerance = "1e-8",
    workers: Annotated[str, option(kind="INTEGER", help="Number of processes that compute slices.")] = "2",
    out: Out = "out",
    fresh: Fresh = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Map the plane of two controls, clamp angle and shear by default: loci, regions of stability, events."""
    from rodatlas.cli.phase import run

    run(fixed_in(context), where, angle_min, angle_max, tol, workers, out, json_target(json_to, overwrite), fresh)


@model_command("solve")
def solve_command(
    context: typer.Context,
    state: Annotated[
        str,
        option(
            kind="NAME",
            help="Name: U, W, w, uUu, uUui; of a pair US+, US-, TU+ ..; of several W:1, W:2; where the paper has none, "
            "as slice prints it, A1, C2+ ..",
        ),
    ],
    out: Annotated[
        str | None, option(kind="FILE", help="File for the solution, .h5 and .csv.", default="in out/, by its name")
    ] = None,
    tol: Tolerance = "1e-8",
    folder: Annotated[
        str | None, option("--from", kind="FOLDER", help="Folder of a slice to use.", default="out, if it has one")
    ] = None,
    overwrite: Overwrite = False,
) -> None:
    """Compute one named stable state and print its observables."""
    from rodatlas.cli.solve import run

    run(fixed_in(context), state, out, tol, folder, overwrite)


@command("states")
def states_command(
    shear: Shear,
    angle: AnyAngle = None,
    angle_left: AngleLeft = None,
    angle_right: AngleRight = None,
    compression: Compression = "0.5",
    offset: Offset = "0",
    twist: Twist = "0",
    poisson: Poisson = "0.25",
    classes: Annotated[
        str, option("--class", kind="CLASS", help="+ or -, which a full turn of the right clamp tells apart, or both.")
    ] = "both",
    starts: Annotated[
        str | None,
        option(
            kind="INTEGER",
            help="Starts for each class, at most 1000000.",
            default="4096; with --stable-only until it looks complete",
        ),
    ] = None,
    stable_only: Annotated[bool, flag("--stable-only", help="Search for stable states only.")] = False,
    wound: Annotated[bool, flag("--wound", help="List states with more turns than needed too.")] = False,
    deflate: Annotated[
        str | None,
        option(kind="INTEGER", help="Attempts by deflation after the starts, for each class.", default="none"),
    ] = None,
    threads: Annotated[
        str | None,
        option(kind="INTEGER", help="Threads of the search.", default=f"one per processor, {os.cpu_count()}"),
    ] = None,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Search for all equilibria at one setting: table, and how complete the search looks."""
    from rodatlas.cli.states import run

    target = json_target(json_to, overwrite)
    clamps = (angle, angle_left, angle_right, compression, shear, offset, twist)
    run(clamps, poisson, classes, starts, stable_only, wound, deflate, threads, target)


@command("band")
def band_command(
    length: Annotated[str, option(kind="MM", help="Length between the clamps, in mm.")] = "240",
    width: Annotated[str, option(kind="MM", help="Width in mm, at most the length.")] = "3",
    thickness: Annotated[str, option(kind="MM", help="Thickness in mm, at most the width.")] = "0.127",
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    modulus: Annotated[
        str | None,
        option(kind="NUMBER", help="Young's modulus in GPa, for forces and moments.", default="none, no forces"),
    ] = None,
    density: Annotated[
        str | None, option(kind="NUMBER", help="Density in kg/m³, for the weight.", default="none, no weight")
    ] = None,
    angle: Annotated[
        str, option(kind="DEGREES", help="Clamp angle at which width and errors are judged, 0 <= angle < 90.")
    ] = "15",
    angle_error: Annotated[
        str, option("--angle-error", kind="DEGREES", help="Standard error of the clamps' angle.")
    ] = "1",
    displacement_error: Annotated[
        str, option("--displacement-error", kind="MM", help="Standard error of the clamps' displacement, in mm.")
    ] = "0.5",
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Convert a real band in mm: limiting shear, units of force, errors, and whether the model fits it."""
    from rodatlas.cli.band import run

    errors = (angle_error, displacement_error)
    dimensions, material, target = (length, width, thickness), (modulus, density), json_target(json_to, overwrite)
    run(dimensions, compression, poisson, material, angle, errors, target)


@command("paper")
def paper_command(
    context: typer.Context,
    figure: Annotated[
        list[str] | None,
        option("--figure", kind="NAME", help="Name of a figure, see --list; may be repeated.", default="all"),
    ] = None,
    out: Out = "out",
    listing: Annotated[bool, flag("--list", help="List the figures and exit.")] = False,
    workers: Processes = None,
    fresh: Fresh = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Draw our version of the paper's figures, with its numbers beside ours."""
    from rodatlas.cli.paper import run, show_list

    if not listing:
        run(figure or [], out, workers, json_target(json_to, overwrite), fresh)
    elif others := [name for name in given(context) if name != "list"]:
        raise ValueError(f"list: expected no other option beside --list, got --{others[0]}")
    else:
        show_list()


@command("export")
def export_command(
    context: typer.Context,
    file: Annotated[
        str, argument(kind="FILE", help="File of solve, slice, loci or phase (.h5), or of states --json (.json).")
    ],
    out: Annotated[str, option(kind="FILE", help="File to write; of several tables or shapes, each adds its name.")],
    form: Annotated[
        str | None,
        option("--format", kind="FORMAT", help="csv, vtp, glb or stl.", default="by the name in --out"),
    ] = None,
    width: Annotated[
        str | None, option(kind="RATIO", help="Width over length of shapes, in L.", default="1/80")
    ] = None,
    band: Annotated[
        str | None,
        option(
            kind="LxWxT",
            help="Band in mm such as 240x30x0.127: shapes and lengths in mm; stl needs it.",
            default="lengths in L",
        ),
    ] = None,
    state: Annotated[str | None, option(kind="NAME", help="One state: of a slice, with --at.", default="all")] = None,
    at: Annotated[
        str | None,
        option(
            "--at",
            kind="NUMBER",
            help="Value of what varies at which shapes of a slice are wanted.",
            default="where most states coexist",
        ),
    ] = None,
    samples: Annotated[
        str, option(kind="INTEGER", help="Cross-sections of shapes, rows of the table of a state; 3 to 100000.")
    ] = "481",
    overwrite: Overwrite = False,
) -> None:
    """Write tables (CSV) or shapes (VTP, GLB, STL) of a result for other programs."""
    from rodatlas.cli.export import run

    run(file, form, out, width, band, state, at, samples, "samples" in given(context), overwrite)


@command("study")
def study_command(
    file: Annotated[str, argument(kind="FILE.toml", help="What is wanted: grids and lists of settings.")],
    out: Annotated[str, option(kind="FOLDER", help="Folder for the results; one that is there already goes on.")],
    workers: Processes = None,
    scheduler: Annotated[
        str | None,
        option(kind="ADDRESS", help="Dask scheduler whose workers compute, tcp://host:port.", default="none"),
    ] = None,
    dry_run: Annotated[bool, flag("--dry-run", help="List what would be computed, and stop.")] = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """Compute many slices, loci and searches for states, as a file describes them; resume what is there."""
    from rodatlas.cli.study import run

    raise typer.Exit(run(file, out, workers, scheduler, dry_run, json_target(json_to, overwrite)))


@command("show")
def show_command(
    folder: Annotated[str, argument(kind="FOLDER", help="With results of any command.")],
    check: Annotated[bool, flag("--check", help="Read every file to the last byte.")] = False,
    json_to: Json = None,
    overwrite: Overwrite = False,
) -> None:
    """List the results in a folder: settings, contents, warnings, and whether they are complete."""
    from rodatlas.cli.show import run

    run(folder, check, json_target(json_to, overwrite))
