"""A digest of the code that decides the numbers of a result."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]


@lru_cache(maxsize=32)
def code_hash(*places: str) -> str:
    """Eight hexadecimal digits that stand for the source of some folders or files of the package, all below included.

    Parameters
    ----------
    places : paths from the package on, 'atlas/slices'.

    Raises
    ------
    ValueError
        for a place that there is not.
    """
    found = hashlib.sha256()
    for place in places:
        top = PACKAGE / place
        files = sorted(top.rglob("*.py")) if top.is_dir() else [top.with_suffix(".py")]
        if not files or not files[0].exists():
            raise ValueError(f"places: expected folders or files of {PACKAGE.name}, got '{place}'")
        for file in files:
            found.update(str(file.relative_to(PACKAGE).as_posix()).encode() + b"\0" + file.read_bytes())
    return found.hexdigest()[:8]
