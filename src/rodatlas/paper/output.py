"""Files of the drawn figures, and the tables of numbers: fig-NAME.png, .pdf and .json, paper.md and paper.json."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rodatlas import __version__
from rodatlas.files import keep_other_json, set_aside, write_text
from rodatlas.paper import ENTRIES, NOT_DRAWN, PAPER, Entry
from rodatlas.paper.drawn import Drawn
from rodatlas.paper.sources import Sources

SCHEMA = "rodatlas/paper/1"
INTRODUCTION = f"""\
The figures of {PAPER}, drawn anew from computed results by `rodatlas paper`, and their numbers beside those known from
elsewhere. Lengths are in units of L, forces of GJ/L², energies of GJ/L; the compression is ΔL = 1/2 and Poisson's ratio
1/4 unless said.

*Known* is what the paper gives ("paper", read to the digits shown), what AUTO-07p and a shooting program give
("independent"), or a closed form. *Difference* is ours less that, in bold where it exceeds the last digit shown.
"""
DISAGREEMENTS = """\
## Differences from the paper, and conventions

- **Clamp condition.** The paper prints x(1) = ΔL at the right clamp. The ends are 1 − ΔL apart, so that this holds only
  at ΔL = 1/2, where all its figures are; we use x(1) = 1 − ΔL at every compression.
- **Stability.** The paper infers from experiments and from the diagrams which states are stable. Here the index of
  every equilibrium is computed by conjugate points, and compared with the second variation; the figures show it.
- **W near 77 degrees.** Without shear, W is lost to a mode normal to its plane, while the planar state goes on; see the
  figure `critical-mode`. Planar theory does not show this loss.
- **Energy density.** The paper plots a κ₁² + τ², twice the energy density; so do the figures here, and say so.
"""


def draw_to(entry: Entry, sources: Sources, folder: Path) -> dict[str, Any]:
    """Draw one figure into a folder; its record, which is written beside it."""
    from rodatlas.plot import save_figure

    drawn = entry.draw(sources)
    stem = folder / f"fig-{entry.name}"
    save_figure(drawn.figure, stem)
    record = _record(entry, drawn)
    data = Path(f"{stem}.json")
    keep_other_json(data, lambda known: known["name"] == entry.name and "of_paper" in known)
    write_text(data, json.dumps(record, indent=1, ensure_ascii=False) + "\n")
    return record


def _record(entry: Entry, drawn: Drawn) -> dict[str, Any]:
    return {
        "rodatlas": __version__,
        "name": entry.name,
        "of_paper": entry.of_paper,
        "description": entry.description,
        "caption": drawn.caption,
        "remarks": list(drawn.remarks),
        "numbers": [n.to_json() for n in drawn.numbers],
    }


def stored_records(folder: Path, say: Callable[[str], None] = lambda line: None) -> list[dict[str, Any]]:
    """Records of all figures that this version has drawn into a folder, in the order of the paper.

    A damaged record is renamed, and `say` told so.
    """
    records = []
    for entry in ENTRIES:
        path = folder / f"fig-{entry.name}.json"
        if not path.exists():
            continue
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            version = record["rodatlas"]
        except (ValueError, KeyError, TypeError):
            say(f"{path.name} is damaged and is kept as {set_aside(path).name}: draw that figure again")
            continue
        if version == __version__:
            records.append(record)
    return records


def write_tables(folder: Path, say: Callable[[str], None] = lambda line: None) -> tuple[Path, Path]:
    """Write paper.md and paper.json from the records of a folder; their paths."""
    records = stored_records(folder, say)
    page, data = folder / "paper.md", folder / "paper.json"
    images = {r["name"]: f"fig-{r['name']}.png" for r in records}
    write_text(page, page_of(records, images))
    keep_other_json(data, lambda known: known["schema"] == SCHEMA)
    write_text(data, json.dumps(to_json(records), indent=1, ensure_ascii=False) + "\n")
    return page, data


def to_json(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The object that `rodatlas paper --json` prints."""
    return {"schema": SCHEMA, "paper": PAPER, "figures": list(records), "not_drawn": dict(NOT_DRAWN)}


def page_of(records: Sequence[Mapping[str, Any]], images: Mapping[str, str]) -> str:
    """The page that compares numbers with the paper, in Markdown.

    Parameters
    ----------
    images : name of a figure -> path of its picture, for those that are shown.
    """
    parts = ["# Figures and numbers of the paper\n", INTRODUCTION, *_agreement(records), DISAGREEMENTS]
    for record in records:
        of = f"figure {record['of_paper']} of the paper" if record["of_paper"] else "not in the paper"
        parts.append(f"## {record['name']}\n")
        parts.append(f"{record['caption']} ({of.capitalize()}.)\n")
        if record["name"] in images:
            parts.append(f"![{record['description']}]({images[record['name']]})\n")
        if record["numbers"]:
            parts.append(_table(record["numbers"]))
        parts += [f"- {remark}" for remark in record["remarks"]] + ([""] if record["remarks"] else [])
    parts.append("## Figures of the paper that are not drawn\n")
    parts += [f"- {of}: {why}." for of, why in NOT_DRAWN.items()]
    return "\n".join(parts).rstrip() + "\n"


def _agreement(records: Iterable[Mapping[str, Any]]) -> list[str]:
    """A paragraph on the numbers that differ from those known from elsewhere."""
    numbers = [(r["name"], n) for r in records for n in r["numbers"] if "known" in n]
    differ = [f"{name}: {n['quantity']}" for name, n in numbers if not n["agrees"]]
    if not numbers:
        return []
    line = f"{len(numbers) - len(differ)} of {len(numbers)} known numbers agree to the last digit shown."
    return [line + (f" Others: {'; '.join(differ)}." if differ else "") + "\n"]


def _table(numbers: Sequence[Mapping[str, Any]]) -> str:
    rows = ["| quantity | ours | known | source | difference |", "|---|---|---|---|---|"]
    for n in numbers:
        known = n.get("known")
        unit = f" {n['unit']}" if n["unit"] not in ("", "L", "GJ/L", "GJ/L²") else ""
        if known is None:
            rows.append(f"| {n['quantity']} | {text_of(n['value'])}{unit} | | | |")
            continue
        difference = f"{n['difference']:.1e}" if n["difference"] else "0"
        difference = difference if n["agrees"] else f"**{difference}**"
        ours, theirs = texts_of(n["value"], known["value"], known["resolution"])
        source = known["source"]
        rows.append(f"| {n['quantity']} | {ours}{unit} | {theirs}{unit} | {source} | {difference} |")
    return "\n".join(rows) + "\n"


def text_of(value: float) -> str:
    """A number with six digits; a whole one as it is."""
    return f"{value:.0f}" if value == round(value) and abs(value) < 1000 else f"{value:.6g}"


def texts_of(value: float, known: float, resolution: float) -> tuple[str, str]:
    """Ours and the known number, that with the digits that it has, ours with one or two more."""
    if not resolution:
        return text_of(value), text_of(known)
    digits = max(0, math.ceil(-math.log10(2.0 * resolution)))  # the resolution is half a unit of the last digit or more
    more = 1 if digits > 2 else 2
    return f"{value:.{digits + more}f}", f"{known:.{digits}f}"
