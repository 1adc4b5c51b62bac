"""Commands and how errors reach the user: one line on stderr and exit code 2."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from rodatlas import __version__

app = typer.Typer(
    help="Equilibria, stability and bifurcations of clamped elastic bands.",
    no_args_is_help=False,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Angle = Annotated[str, typer.Option("--angle", help="Clamp angle psi0 in degrees, 0 <= angle < 90.")]
Compression = Annotated[str, typer.Option(help="dL; the ends are 1 - dL apart along x.")]
Poisson = Annotated[str, typer.Option(help="Poisson's ratio of the band.")]
Tolerance = Annotated[str, typer.Option("--tol", help="Largest error at mesh points, relative to each unknown.")]


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Equilibria, stability and bifurcations of clamped elastic bands."""
    if version:
        print(__version__)
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command("slice")
def slice_command(
    angle: Angle,
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    shear_max: Annotated[str, typer.Option(help="Largest shear dD [default: 0.9469 of the limiting shear].")] = "",
    shear_min: Annotated[str, typer.Option(help="Least shear [default: -0.0577 of the limiting shear].")] = "",
    search: Annotated[
        str, typer.Option(help="Starts of the search for isolated stable states at each of some shears; 0: none.")
    ] = "256",
    tol: Tolerance = "1e-8",
    out: Annotated[str, typer.Option(help="Folder for figures and data.")] = "out",
    fresh: Annotated[bool, typer.Option("--fresh", help="Compute everything again, even what the folder has.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the result as JSON to a file too, or to -.")] = "",
    overlay: Annotated[str, typer.Option(help="CSV of measured ranges (state, shear_min, shear_max ..).")] = "",
    band: Annotated[str, typer.Option(help="Band in mm behind --overlay, such as 240x3x0.127.")] = "",
) -> None:
    """Follow all equilibria at one clamp angle as the shear varies: table, figures and data."""
    from rodatlas.cli.slice import run

    run((angle, compression, poisson, tol, shear_max, shear_min, search), out, json_to, fresh, overlay, band)


@app.command("loci")
def loci_command(
    number: Annotated[
        list[str] | None, typer.Option("--number", help="Number of a bifurcation, 0 to 18; may be repeated.")
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="All that have numbers, the default.")] = False,
    angle_max: Annotated[str, typer.Option("--angle-max", help="Largest clamp angle in degrees.")] = "80",
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    tol: Tolerance = "1e-8",
    out: Annotated[str, typer.Option(help="Folder for the figure and data.")] = "out",
    fresh: Annotated[bool, typer.Option("--fresh", help="Compute everything again, even what the folder has.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the result as JSON to a file too, or to -.")] = "",
) -> None:
    """Follow numbered bifurcations in clamp angle and shear: special points, figure and data."""
    from rodatlas.cli.loci import run

    if everything and number:
        raise ValueError("all: expected no --number beside --all")
    run(number or [], angle_max, compression, poisson, tol, out, json_to, fresh)


@app.command("phase")
def phase_command(
    angle_min: Annotated[str, typer.Option("--angle-min", help="Smallest clamp angle in degrees.")] = "0",
    angle_max: Annotated[str, typer.Option("--angle-max", help="Largest clamp angle in degrees.")] = "80",
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    tol: Tolerance = "1e-8",
    workers: Annotated[str, typer.Option(help="Number of processes that compute slices.")] = "2",
    out: Annotated[str, typer.Option(help="Folder for figures and data.")] = "out",
    fresh: Annotated[bool, typer.Option("--fresh", help="Compute everything again, even what the folder has.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the result as JSON to a file too, or to -.")] = "",
) -> None:
    """Map the plane of clamp angle and shear: loci, regions of stability of every state, events."""
    from rodatlas.cli.phase import run

    run(angle_min, angle_max, compression, poisson, tol, workers, out, json_to, fresh)


@app.command("solve")
def solve_command(
    angle: Angle,
    shear: Annotated[str, typer.Option(help="Shear dD.")],
    state: Annotated[str, typer.Option(help="Name: U, W, w, uUu, uUui; of a pair: US+, US-, WS+, TU+, TW+, S+ ..")],
    out: Annotated[str, typer.Option(help="File for the solution, .h5 and .csv [default: in out/, by its name].")] = "",
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    tol: Tolerance = "1e-8",
    folder: Annotated[str, typer.Option("--from", help="Folder of a slice to use if there [default: out].")] = "",
) -> None:
    """Compute one named stable state and print its observables."""
    from rodatlas.cli.solve import run

    run(angle, shear, state, out, compression, poisson, tol, folder)


@app.command("states")
def states_command(
    angle: Angle,
    shear: Annotated[str, typer.Option(help="Shear dD.")],
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    classes: Annotated[str, typer.Option("--class", help="Right clamp at +q, at -q (a full turn), or both.")] = "both",
    starts: Annotated[
        str, typer.Option(help="Starts for each class [default: 4096; with --stable-only until it looks complete].")
    ] = "",
    stable_only: Annotated[bool, typer.Option("--stable-only", help="Search for stable states only.")] = False,
    wound: Annotated[bool, typer.Option("--wound", help="List states with more turns than needed too.")] = False,
    deflate: Annotated[str, typer.Option(help="Attempts by deflation after the starts, for each class.")] = "",
    threads: Annotated[str, typer.Option(help="Threads of the search [default: one per processor].")] = "",
    json_to: Annotated[str, typer.Option("--json", help="Write the result as JSON to a file too, or to -.")] = "",
) -> None:
    """Search for all equilibria at one setting: table, and how complete the search looks."""
    from rodatlas.cli.states import run

    run(angle, shear, compression, poisson, classes, starts, stable_only, wound, deflate, threads, json_to)


@app.command("band")
def band_command(
    length: Annotated[str, typer.Option(help="Length between the clamps, in mm.")] = "240",
    width: Annotated[str, typer.Option(help="Width in mm.")] = "3",
    thickness: Annotated[str, typer.Option(help="Thickness in mm.")] = "0.127",
    compression: Compression = "0.5",
    poisson: Poisson = "0.25",
    modulus: Annotated[str, typer.Option(help="Young's modulus in GPa, for forces and moments.")] = "",
    density: Annotated[str, typer.Option(help="Density in kg/m³, for the weight.")] = "",
    angle: Annotated[str, typer.Option(help="Clamp angle in degrees at which width and errors are judged.")] = "15",
    angle_error: Annotated[str, typer.Option("--angle-error", help="Of the clamps, in degrees.")] = "1",
    displacement_error: Annotated[str, typer.Option("--displacement-error", help="Of the clamps, in mm.")] = "0.5",
    json_to: Annotated[str, typer.Option("--json", help="Write the result as JSON to a file too, or to -.")] = "",
) -> None:
    """Convert a real band in mm: limiting shear, units of force, errors, and whether the model fits it."""
    from rodatlas.cli.band import run

    errors = (angle_error, displacement_error)
    run((length, width, thickness), compression, poisson, (modulus, density), angle, errors, json_to)


@app.command("paper")
def paper_command(
    figure: Annotated[
        list[str] | None, typer.Option("--figure", help="Name of a figure, see --list; may be repeated.")
    ] = None,
    out: Annotated[str, typer.Option(help="Folder for figures and data.")] = "out",
    listing: Annotated[bool, typer.Option("--list", help="List the figures and exit.")] = False,
    workers: Annotated[str, typer.Option(help="Processes that compute slices [default: one per processor].")] = "",
    fresh: Annotated[bool, typer.Option("--fresh", help="Compute everything again, even what the folder has.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the numbers as JSON to a file too, or to -.")] = "",
) -> None:
    """Draw our version of the paper's figures, with its numbers beside ours."""
    from rodatlas.cli.paper import run, show_list

    if listing:
        show_list()
    else:
        run(figure or [], out, workers, json_to, fresh)


@app.command("export")
def export_command(
    file: Annotated[str, typer.Argument(help="File of solve, slice or loci (.h5), or of states --json (.json).")],
    out: Annotated[str, typer.Option(help="File to write; of several tables or shapes, each adds its name.")],
    form: Annotated[str, typer.Option("--format", help="csv, vtp, glb or stl [default: by the name in --out].")] = "",
    width: Annotated[str, typer.Option(help="Width over length of shapes, in L [default: 1/80].")] = "",
    band: Annotated[str, typer.Option(help="Band in mm such as 240x30x0.127: shapes and lengths in mm.")] = "",
    state: Annotated[str, typer.Option(help="One state of a slice, with --shear.")] = "",
    shear: Annotated[str, typer.Option(help="Shear at which shapes of a slice are wanted.")] = "",
    samples: Annotated[str, typer.Option(help="Cross-sections of shapes, rows of the table of a state.")] = "481",
) -> None:
    """Write tables (CSV) or shapes (VTP, GLB, STL) of a result for other programs."""
    from rodatlas.cli.export import run

    run(file, form, out, width, band, state, shear, samples)


@app.command("study")
def study_command(
    file: Annotated[str, typer.Argument(metavar="FILE.toml", help="What is wanted: grids and lists of settings.")],
    out: Annotated[str, typer.Option(help="Folder for the results; one that is there already goes on.")],
    workers: Annotated[str, typer.Option(help="Processes on this machine [default: one for each processor].")] = "",
    scheduler: Annotated[str, typer.Option(help="Dask scheduler whose workers compute, tcp://host:port.")] = "",
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List what would be computed, and stop.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the outcome as JSON to a file too, or to -.")] = "",
) -> None:
    """Compute many slices, loci and searches for states, as a file describes them; resume what is there."""
    from rodatlas.cli.study import run

    raise typer.Exit(run(file, out, workers, scheduler, dry_run, json_to))


@app.command("show")
def show_command(
    folder: Annotated[str, typer.Argument(metavar="FOLDER", help="With results of any command.")],
    check: Annotated[bool, typer.Option("--check", help="Read every file to the last byte.")] = False,
    json_to: Annotated[str, typer.Option("--json", help="Write the list as JSON to a file too, or to -.")] = "",
) -> None:
    """List the results in a folder: settings, contents, warnings, and whether they are complete."""
    from rodatlas.cli.show import run

    run(folder, check, json_to)


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point: wrong input is one line and exit code 2, an interrupt is exit code 130."""
    command = typer.main.get_command(app)
    try:
        code = command(args=list(arguments) if arguments is not None else None, prog_name="rodatlas",
                       standalone_mode=False)  # fmt: skip
        sys.exit(code if isinstance(code, int) else 0)
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(130)
    except ValueError as error:
        _fail(str(error))
    except OSError as error:
        got = f"'{error.filename}' ({error.strerror or error})" if error.filename else error.strerror or error
        _fail(f"out: expected a file that can be written, got {got}")
    except Exception as error:
        # wrong usage comes as an exception that formats its own message
        if hasattr(error, "format_message"):
            _fail(error.format_message())
        raise


def _fail(message: str) -> None:
    print(f"rodatlas: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(2)
