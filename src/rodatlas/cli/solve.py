"""`rodatlas solve`: one named state, its observables, and its files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from rodatlas import __version__
from rodatlas.cli.common import note, number, progress_bar, shown
from rodatlas.cli.controls import Fixed
from rodatlas.cli.output import KEPT, Identity, file_target
from rodatlas.cli.setting import slice_settings_from
from rodatlas.cli.tables import say_table
from rodatlas.files import claimed, exact
from rodatlas.states.labels import in_file_name, parse_label

if TYPE_CHECKING:
    from rodatlas.atlas.slices.settings import SliceSettings
    from rodatlas.continuation import Solution
    from rodatlas.model import Model


def run(fixed: Fixed, state: str, out: str | None, tol: str, folder: str | None, overwrite: bool) -> None:
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    overwrite : whether a file that holds something else may be replaced.
    """
    along = fixed.model.control(fixed.model.plane[1])
    typed = fixed.texts.get(along.name)
    value = along.default if typed is None else number(along.name, typed)
    settings = slice_settings_from(fixed._replace(texts={**fixed.texts, along.name: None}), tol)
    settings.control.check(value, settings.setting)
    at = settings.whole_setting(value)
    from rodatlas.atlas.slices.reach import reach

    known = settings.model.nomenclature
    label = parse_label(state, known.names).label if known is not None and settings.named else state
    if folder is not None and not _has_slice(folder):
        raise ValueError(f"from: expected a folder with a slice, got '{shown(folder)}'")
    identity = {
        "rodatlas": __version__, "state": label, **settings.model.setting_json(at), "tolerance": settings.tolerance,
    }  # fmt: skip
    path = file_target(f"out/{_stem(label, value, settings)}.h5" if out is None else out)
    path = path if path.suffix == ".h5" else path.with_name(f"{path.name}.h5")
    if not overwrite:
        _expect(path, identity)
    with progress_bar(f"{label} at {settings.place_text}, {along.name} {value:g}") as report:
        solution, source = reach(settings, state, value, progress=report, folder=Path(folder or "out"))
    if folder is not None and source != "stored slice":
        note(f"{folder} has no slice of these settings with the state; it comes from a {source}")
    table = _write(path, solution, identity, overwrite)
    console = Console()
    say_table(console, _table(settings.model, f"{label} (from a {source})", solution))
    if settings.control.care is not None and (care := settings.control.care(value, settings.setting)):
        console.print(f"warning: {care}", style="yellow", markup=False, soft_wrap=True)
    console.print(f"wrote {path} and {table}", highlight=False, soft_wrap=True)


def _stem(label: str, value: float, settings: SliceSettings) -> str:
    """Name of the files of a state, other for all other settings: 'US+-15-dD0.5-dL0.4'."""
    first = settings.model.stem_parts(settings.setting)[0]
    other = settings.stem.removeprefix(f"slice-{first}")
    return f"{in_file_name(label)}-{first}-{settings.control.in_files}{exact(value)}{other}"


def _expect(path: Path, identity: Identity) -> None:
    """Refuse files that hold another state, or something else."""
    table = path.with_suffix(".csv")
    for file in (path, table):
        if file.exists() and _identity_in(path) != identity:
            raise ValueError(f"out: {KEPT.format(shown(str(file)))}")


def _identity_in(path: Path) -> dict[str, object] | None:
    """What the file of a state says of itself; None where it is none."""
    from rodatlas.continuation.store.hdf5 import checked_hdf5
    from rodatlas.continuation.store.solutions import SCHEMA

    try:
        with checked_hdf5(path, SCHEMA) as file:
            return json.loads(file.attrs["identity"])
    except (OSError, ValueError):
        return None


def _write(path: Path, solution: Solution, identity: Identity, overwrite: bool) -> Path:
    """Write the state and its table, unless another run has written another one there meanwhile; the table's path."""
    from rodatlas.continuation.store.solutions import save_solution
    from rodatlas.plot.exports import solution_table, write_csv

    path.parent.mkdir(parents=True, exist_ok=True)
    table = path.with_suffix(".csv")
    with claimed(table, note), claimed(path, note):  # in order of name, as `export` does
        if not overwrite:
            _expect(path, identity)
        save_solution(path, solution, identity)
        write_csv(table, *solution_table(solution), bare=True)
    return table


def _has_slice(folder: str) -> bool:
    """Whether a folder is there and holds any slice."""
    try:
        return any(Path(folder).glob("slice*.h5"))
    except (OSError, ValueError):
        return False


def _table(model: Model, title: str, solution: Solution) -> Table:
    """What the state is like, by the quantities of its model, or as a rod where it is one."""
    table = Table(show_header=False)
    for row in [("state", title), *(_quantities(model, solution) if model.ribbon is None else _rod(model, solution))]:
        table.add_row(*row)
    return table


def _quantities(model: Model, solution: Solution) -> list[tuple[str, str]]:
    """Of a problem that is no rod."""
    index = None if model.index is None else model.index(solution)
    return [
        *((q.name, f"{q.read(solution):.9f} {q.unit}".strip()) for q in model.quantities),
        *([] if index is None else [("Morse index", f"{index} ({'stable' if index == 0 else 'unstable'})")]),
        ("estimated error", f"{solution.error:.1e} of each unknown's scale, {solution.intervals} intervals"),
    ]


def _rod(model: Model, solution: Solution) -> list[tuple[str, str]]:
    """Of a rod."""
    from rodatlas.rods.contact import places_text, self_contact, width_text
    from rodatlas.rods.stability import index_of

    assert model.ribbon is not None
    rod = model.ribbon(solution)
    index = index_of(solution, formulation=rod.formulation)
    bending, twist = rod.energy_parts
    drift = {k: float(np.ptp(v)) for k, v in rod.first_integrals.items()}
    rows = [
        ("height int y ds", f"{rod.height:.9f} L"),
        ("energy", f"{rod.energy:.9f} GJ/L = {bending:.6f} bending + {twist:.6f} twist"),
        ("N(0), body", " ".join(f"{x:.8f}" for x in rod.force_body[0]) + " GJ/L^2"),
        ("M(0), body", " ".join(f"{x:.8f}" for x in rod.moment_body[0]) + " GJ/L"),
        ("Morse index", f"{index.index} ({'stable' if index.index == 0 else 'unstable'}; distance to singular "
                        f"{index.margin:.2e}){'' if index.trusted else ' not trusted: ' + index.reason}"),
        ("reversal-symmetric", "yes" if rod.symmetric else "no"),
        ("inflections", f"{rod.inflections['k1']} of k1, {rod.inflections['tau']} of tau"),
        ("estimated error", f"{solution.error:.1e} of each unknown's scale, {solution.intervals} intervals"),
        ("drift of first integrals", ", ".join(f"{k}: {v:.1e}" for k, v in drift.items())),
    ]  # fmt: skip
    if model.width and (contact := self_contact(solution, model.width)):
        where = f"a band {width_text(contact.width)} wide, at s = {places_text(contact)}"
        rows.insert(6, ("touches itself", f"{where}; forces of contact are not modeled"))
    return rows
