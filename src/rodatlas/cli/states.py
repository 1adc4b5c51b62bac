"""`rodatlas states`: all equilibria at one setting, as a table or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer
from rich.console import Console
from rich.table import Table

from rodatlas import __version__
from rodatlas.cli.common import (
    DEFLATIONS,
    STARTS,
    WORKERS,
    ends_from,
    note,
    number,
    progress_bar,
    shown,
    whole_number,
)
from rodatlas.cli.output import JsonTarget, json_text
from rodatlas.cli.tables import say_table

if TYPE_CHECKING:
    from rodatlas.states.discover import Discovery


def run(
    clamps: tuple[str | None, str | None, str | None, str, str, str, str], poisson: str, classes: str,
    starts: str | None, stable_only: bool, wound: bool, deflate: str | None, threads: str | None, json_to: JsonTarget,
) -> None:  # fmt: skip
    """The command; texts come as typed and are checked here.

    Parameters
    ----------
    clamps : the arguments of :func:`rodatlas.cli.common.ends_from`.

    Raises
    ------
    typer.Exit
        with code 1 when the search found nothing: one line says why, after the table and the JSON are written.
    """
    from rodatlas.rods.band import check_poisson
    from rodatlas.states.discover import CLASSES, find_states
    from rodatlas.states.store import ALGORITHM

    ends = ends_from(*clamps)
    ratio = check_poisson(number("poisson", poisson))
    if classes not in CLASSES:
        raise ValueError(f"class: expected +, - or both, got '{shown(classes)}'")
    count = whole_number("starts", starts, STARTS) if starts is not None else None
    attempts = whole_number("deflate", deflate, DEFLATIONS) if deflate is not None else 0
    workers = whole_number("threads", threads, WORKERS) if threads is not None else None
    identity = {
        "rodatlas": __version__, "algorithm": ALGORITHM, **ends.setting, "poisson": ratio, "classes": classes,
        "starts": count or 0, "stable_only": stable_only, "wound": wound, "deflate": attempts,
    }  # fmt: skip
    json_to.expect(identity)
    at = f"{ends.angle_deg:g}" if ends.skew_deg == 0.0 else f"{ends.left_deg:g} and {ends.right_deg:g}"
    with progress_bar(f"states at {at} deg, shear {ends.shear:g}") as report:
        found = find_states(ends, ratio, classes, count, stable_only=stable_only, wound=wound, deflate=attempts,
                            threads=workers, progress=report)  # fmt: skip
    console = Console(stderr=json_to.on_stdout)
    say_table(console, _table(found))
    console.print(_summary(found), highlight=False, soft_wrap=True)
    json_to.write(json_text(found.to_json(), identity), identity)
    if found.failed:
        note(f"rodatlas: {found.warnings[0]}")
        raise typer.Exit(1)
    for warning in found.remarks:
        console.print(f"warning: {warning}", style="yellow", markup=False, soft_wrap=True)


def _table(found: Discovery) -> Table:
    from rodatlas.rods.band import NARROW
    from rodatlas.rods.contact import places_text, width_text

    touching = any(s.contact for s in found.states)
    caption = "index 0: stable; k1, tau: inflections; turns: int tau ds / 2 pi"
    if touching:
        caption += f"; touches: arclengths at which a band {width_text(NARROW)} wide passes through itself"
    table = Table(box=None, caption=caption, padding=(0, 1))
    titles = ("name", "class", "index", "energy", "height", "pair", "|N|", "turns", "k1", "tau", "met")
    for title in (*titles, *(["touches"] if touching else [])):
        table.add_column(title, justify="left" if title == "name" else "right", no_wrap=True)
    for state, label in zip(found.states, found.labels, strict=True):
        plain = state.to_json()
        table.add_row(
            label or "", state.cls, "?" if state.index < 0 else str(state.index),
            f"{plain['energy']:.6f}", f"{plain['height']:.7f}", state.pair or "",
            f"{sum(x * x for x in plain['N0']) ** 0.5:.4g}", f"{state.turns:.2f}",
            str(plain["inflections"]["k1"]), str(plain["inflections"]["tau"]), str(state.count),
            *([places_text(state.contact)] if touching else []),
        )  # fmt: skip
    return table


def _summary(found: Discovery) -> str:
    """How complete the search looks, in words."""
    within = f" with |N| up to {found.force_range:g}" if found.force_range else ""
    rounds = f" in {len(found.rounds)} rounds" if len(found.rounds) > 1 else ""
    lost = f"; {found.dropped} not confirmed by collocation" if found.dropped else ""
    left = found.wound_left_out
    wound = f" {_counted(left, 'wound-up state', 'was', 'were')} met besides (--wound lists them)." if left else ""
    added = f" Deflation added {found.deflated[0]} in {found.deflated[1]} attempts." if found.deflated else ""
    return (
        f"{found.converged} of {found.starts} starts{rounds} converged{within}; "
        f"{_counted(found.distinct, 'different state')} listed (a +/- pair counts once){lost}.{wound}{added} "
        f"{completeness(found)}."
    )


def _counted(number: int, noun: str, one: str = "is", more: str = "are") -> str:
    """'1 state is', '2 states are'."""
    return f"{number} {noun} {one}" if number == 1 else f"{number} {noun}s {more}"


def completeness(found: Discovery) -> str:
    """How many states a search has not met, as far as it can tell."""
    if found.unseen_estimate is None or found.unseen_probability is None:
        return "Too few were met to tell how many were not"
    return (
        f"By the number met once, about {_few(found.unseen_estimate)} more were not met, and one more solution would "
        f"be new with probability {found.unseen_probability:.1%}: an estimate, no proof"
    )


def _few(estimate: float) -> str:
    """A number of states, with a decimal only where that matters: '0', '0.5', '20'."""
    return f"{estimate:.2g}" if estimate < 10.0 else f"{estimate:.0f}"
