"""`rodatlas states`: all equilibria at one setting, as a table or JSON."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.table import Table

from rodatlas.cli.common import json_target, note, number, progress_bar
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.states.discover import Discovery


def run(
    angle: str, shear: str, compression: str, poisson: str, classes: str, starts: str, stable_only: bool, wound: bool,
    deflate: str, threads: str, json_to: str,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Raises
    ------
    typer.Exit
        with code 1 when the search found nothing: one line says why, after the table and the JSON are written.
    """
    from rodatlas.rods.band import check_poisson
    from rodatlas.rods.ends import Ends
    from rodatlas.states.discover import CLASSES, find_states

    ends = Ends(number("angle", angle), number("compression", compression), number("shear", shear))
    ratio = check_poisson(number("poisson", poisson))
    if classes not in CLASSES:
        raise ValueError(f"class: expected +, - or both, got '{classes}'")
    count = _count("starts", starts) if starts else None
    attempts = _count("deflate", deflate) if deflate else 0
    workers = _count("threads", threads) if threads else None
    json_file = json_target(json_to)
    with progress_bar(f"states at {ends.angle_deg:g} deg, shear {ends.shear:g}") as report:
        found = find_states(ends, ratio, classes, count, stable_only=stable_only, wound=wound, deflate=attempts,
                            threads=workers, progress=report)  # fmt: skip
    text = json.dumps(found.to_json(), indent=1) + "\n"
    console = Console(stderr=json_to == "-")
    say_table(console, _table(found))
    console.print(_summary(found), highlight=False, soft_wrap=True)
    if json_to == "-":
        sys.stdout.write(text)
    elif json_file is not None:
        json_file.write_text(text)
    if found.failed:
        note(f"rodatlas: {found.warnings[0]}")
        raise typer.Exit(1)
    for warning in found.warnings:
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)


def _count(field: str, text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise ValueError(f"{field}: expected a whole number of at least 1, got '{text}'")
    return int(text)


def _table(found: Discovery) -> Table:
    table = Table(box=None, caption="index 0: stable; k1, tau: inflections; turns: int tau ds / 2 pi", padding=(0, 1))
    for title in ("name", "class", "index", "energy", "height", "pair", "|N|", "turns", "k1", "tau", "met"):
        table.add_column(title, justify="left" if title == "name" else "right", no_wrap=True)
    for state, label in zip(found.states, found.labels, strict=True):
        plain = state.to_json()
        table.add_row(
            label or "", state.cls, "?" if state.index < 0 else str(state.index),
            f"{plain['energy']:.6f}", f"{plain['height']:.7f}", state.pair or "",
            f"{sum(x * x for x in plain['N0']) ** 0.5:.4g}", f"{state.turns:.2f}",
            str(plain["inflections"]["k1"]), str(plain["inflections"]["tau"]), str(state.count),
        )  # fmt: skip
    return table


def _summary(found: Discovery) -> str:
    """How complete the search looks, in words."""
    within = f" with |N| up to {found.force_range:g}" if found.force_range else ""
    rounds = f" in {len(found.rounds)} rounds" if len(found.rounds) > 1 else ""
    lost = f"; {found.dropped} not confirmed by collocation" if found.dropped else ""
    left = found.wound_left_out
    wound = f" {left} more that are wound up were met (--wound lists them)." if left else ""
    added = f" Deflation added {found.deflated[0]} in {found.deflated[1]} attempts." if found.deflated else ""
    return (
        f"{found.converged} of {found.starts} starts{rounds} converged{within}; {found.distinct} different states are "
        f"listed (a +/- pair counts once){lost}.{wound}{added} {completeness(found)}."
    )


def completeness(found: Discovery) -> str:
    """How many states a search has not met, as far as it can tell."""
    if found.unseen_estimate is None or found.unseen_probability is None:
        return "Too few were met to tell how many were not"
    return (
        f"By the number met once, about {found.unseen_estimate:.1f} more were not met, and one more solution would be "
        f"new with probability {found.unseen_probability:.1%}: an estimate, no proof"
    )
