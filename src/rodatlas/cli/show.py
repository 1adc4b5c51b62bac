"""`rodatlas show`: what lies in a folder."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import progress_bar
from rodatlas.cli.output import JsonTarget, json_text
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.atlas.study import Listing
    from rodatlas.atlas.study.inspection import Entry

STYLES = {"partial": "yellow", "damaged": "red", "failed": "red", "missing": "dim"}
# keys of settings that are told otherwise, or tell a reader nothing
HIDDEN = ("setting", "code", "low", "high", "second_low", "second_high", "loci_low", "loci_high")
UNITS = ((10**9, "GB"), (10**6, "MB"), (10**3, "kB"))
SHORT = {
    "angle_deg": "angle", "compression": "dL", "poisson": "nu", "shear": "dD", "tolerance": "tol",
    "shear_min": "dD >=", "shear_max": "dD <=", "angle_min": "angle >=", "angle_max": "angle <=",
    "stable_only": "stable only", "classes": "class", "rodatlas": "version",
}  # fmt: skip


def run(folder: str, check: bool, json_to: JsonTarget) -> None:
    """The command; texts come as typed and are checked here."""
    from rodatlas.atlas.study.listing import list_folder

    if not folder.strip():
        raise ValueError(f"folder: expected a folder with results, got '{folder}'")
    identity = {"folder": os.path.abspath(folder)}
    json_to.expect(identity)
    with progress_bar("reading", lines=False):
        found = list_folder(Path(folder), thorough=check)
    console = Console(stderr=json_to.on_stdout)
    if found.study:
        console.print(f"study: {found.study}", markup=False, highlight=False, soft_wrap=True)
    for kind in dict.fromkeys(e.kind for e in found.entries):
        say_table(console, _table(kind, [e for e in found.entries if e.kind == kind]))
    for entry in found.entries:
        if entry.detail:
            console.print(f"{entry.file} is {entry.status}: {entry.detail}", markup=False, highlight=False,
                          soft_wrap=True)  # fmt: skip
    console.print(summary(found), markup=False, highlight=False, soft_wrap=True)
    json_to.write(json_text(found.to_json(), identity), identity)


def _table(kind: str, entries: Sequence[Entry]) -> Table:
    """A row for each result of one kind; settings that all share stand in the title."""
    common = _shared(entries)
    words = described(common)
    title = {"?": "not readable"}.get(kind, kind)
    table = Table(title=f"{title} ({words})" if words else title, box=None, pad_edge=False, title_justify="left")
    for name in ("file", "settings", "status", "contents"):
        table.add_column(name, overflow="fold", no_wrap=name in ("file", "status"))
    for name in ("seconds", "size"):
        table.add_column(name, justify="right", no_wrap=True)
    for e in entries:
        table.add_row(
            e.file, described({k: v for k, v in flat(e.settings).items() if k not in common}), e.status,
            e.contents + (f", {e.warnings} warnings" if e.warnings else ""),
            "" if e.seconds is None else f"{e.seconds:.1f}", sized(e.size), style=STYLES.get(e.status),
        )  # fmt: skip
    return table


def _shared(entries: Sequence[Entry]) -> dict[str, Any]:
    """Settings that are the same for all of several results that have settings."""
    known = [flat(e.settings) for e in entries if e.settings]
    if len(known) < 2:
        return {}
    return {k: v for k, v in known[0].items() if all(k in s and s[k] == v for s in known)}


def flat(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings without what identifies the code, controls and ranges by name; of those at zero the angle only."""
    if not isinstance(settings.get("setting"), dict):
        return dict(settings)
    found = {k: v for k, v in settings["setting"].items() if v != 0.0 or k == "angle"}
    found |= {k: v for k, v in settings.items() if k not in HIDDEN}
    for ends, control in ((("low", "high"), "along"), (("second_low", "second_high"), "second")):
        for name, word in zip(ends, ("min", "max"), strict=True):
            if name in settings:
                found[f"{settings.get(control)}_{word}"] = settings[name]
    return found


def described(settings: dict[str, Any]) -> str:
    """Settings in short: 'angle 15, dL 0.5'."""
    return ", ".join(f"{SHORT.get(k, k)} {_plain(v)}" for k, v in settings.items())


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def sized(size: int) -> str:
    """A size in bytes with three digits."""
    for unit, name in UNITS:
        if size >= unit:
            return f"{size / unit:.3g} {name}"
    return f"{size} B" if size else ""


def summary(found: Listing) -> str:
    """Counts in one line."""
    kinds = dict.fromkeys(e.status for e in found.entries)
    counts = ", ".join(f"{found.count(status)} {status}" for status in kinds) or "no results"
    total = sized(sum(e.size for e in found.entries))
    others = f"; {found.others} other files" if found.others else ""
    return f"{counts}{f', {total}' if total else ''}{others}"
