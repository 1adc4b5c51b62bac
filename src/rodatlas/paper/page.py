"""The page of the documentation that compares our numbers with the paper's, from a folder of drawn figures.

Run as ``python -m rodatlas.paper.page OUT docs/atlas`` after ``rodatlas paper --out OUT``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rodatlas.paper import figure_names
from rodatlas.paper.output import page_of, stored_records

SHOWN = (
    "setup", "states", "slice-0", "slice-55", "close-ups-28", "close-ups-44", "profiles", "snap", "poisson", "sheared",
    "phase", "critical-mode",
)  # fmt: skip
PIXELS, COLORS = 1000, 256  # width of a picture, and size of its palette


def write_page(folder: Path, target: Path, shown: Sequence[str] = SHOWN) -> list[Path]:
    """Write paper.md and small copies of some figures, paper-NAME.png.

    Parameters
    ----------
    folder : where all figures have been drawn. target : folder of the page. shown : figures that the page shows.

    Returns
    -------
    the files written.

    Raises
    ------
    ValueError
        when a figure has not been drawn.
    """
    records = stored_records(folder)
    missing = [name for name in figure_names() if name not in {r["name"] for r in records}]
    if missing:
        raise ValueError(f"folder: expected all figures to be drawn in {folder}, got none of {', '.join(missing)}")
    written = [_small_copy(folder / f"fig-{name}.png", target / f"paper-{name}.png") for name in shown]
    page = target / "paper.md"
    text = page_of(records, {name: f"paper-{name}.png" for name in shown})
    page.write_text(text, encoding="utf-8")
    return [page, *written]


def _small_copy(source: Path, target: Path) -> Path:
    """A picture with fewer pixels and colors."""
    from PIL import Image

    with Image.open(source) as full:
        height = round(full.height * PIXELS / full.width)
        small = full.convert("RGB").resize((PIXELS, height), Image.Resampling.LANCZOS)
    small.quantize(COLORS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)
    return target


if __name__ == "__main__":
    try:
        for path in write_page(Path(sys.argv[1]), Path(sys.argv[2])):
            print(path)
    except (IndexError, ValueError, OSError) as error:
        sys.exit(f"usage: python -m rodatlas.paper.page OUT docs/atlas ({error})")
