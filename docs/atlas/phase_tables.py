"""Write the tables of phase.md anew: `python docs/atlas/phase_tables.py DIR`, after `rodatlas phase --out DIR`."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from rodatlas.atlas import PhaseDiagram

PAGE = Path(__file__).with_name("phase.md")


def events(diagram: PhaseDiagram) -> list[str]:
    """One row for each special point at which something happens to a slice."""
    rows = ["| angle [deg] | shear | loci | what happens |", "|---|---|---|---|"]
    for e in (e for e in diagram.events if e.parameter != diagram.settings.along):
        rows.append(f"| {e.second:.4f} | {round(e.value, 6) + 0.0:.6f} | {', '.join(e.labels)} | {e.description} |")
    return rows


def regions(diagram: PhaseDiagram) -> list[str]:
    """One row for each region of stability."""
    rows = ["| state | angle [deg] | shear | bounded by |", "|---|---|---|---|"]
    for region in (r for name in diagram.names for r in diagram.state_regions(name)):
        (a0, d0), (a1, d1) = region.rings[0].min(axis=0), region.rings[0].max(axis=0)
        bounds = ", ".join(dict.fromkeys(b.replace("|", "–") for b in region.bounds))
        rows.append(f"| {region.state} | {a0:.4g} to {a1:.4g} | {d0:.4f} to {d1:.4f} | {bounds} |")
    for i in (i for i in diagram.edge if not diagram.state_regions(i.name)):
        rows.append(f"| {i.name} | 0 only | {i.low:.4f} to {i.high:.4f} | |")
    return rows


def main(folder: str) -> None:
    diagram = PhaseDiagram.load(Path(folder) / "phase.h5")
    text = PAGE.read_text(encoding="utf-8")
    for name, rows in (("events", events(diagram)), ("regions", regions(diagram))):
        block = f"<!-- {name} -->\n" + "\n".join(rows) + f"\n<!-- end of {name} -->"
        found = re.findall(f"<!-- {name} -->.*?<!-- end of {name} -->", text, flags=re.DOTALL)
        if len(found) != 1:
            raise ValueError(f"{PAGE}: expected one block '{name}', got {len(found)}")
        text = text.replace(found[0], block)
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
