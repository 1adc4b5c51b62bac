"""Keep a file that cannot be used, under another name."""

from __future__ import annotations

import os
from itertools import count
from pathlib import Path


def set_aside(path: Path, reason: str = "damaged") -> Path:
    """Rename a file or folder to its name with a reason, 'slice-15.h5.damaged', and a number where that is taken.

    Returns
    -------
    the new path.
    """
    for number in count(1):
        aside = path.with_name(f"{path.name}.{reason}" + (f"-{number}" if number > 1 else ""))
        if not aside.exists():
            os.replace(path, aside)
            return aside
    raise AssertionError("unreachable")
