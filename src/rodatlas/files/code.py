"""A digest of the code that decides the numbers of a result."""

from __future__ import annotations

import hashlib
import inspect
from functools import lru_cache
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parents[1]


def code_of(*functions: Any) -> str:
    """Eight hexadecimal digits that stand for the source of what is called, with the modules that it is written in.

    Parameters
    ----------
    functions : functions, or objects of classes; None is left out. What belongs to this package counts by its name.
    """
    found = hashlib.sha256()
    for function in (f for f in functions if f is not None):
        owner = function if inspect.isroutine(function) else type(function)
        found.update(f"{owner.__module__}.{owner.__qualname__}".encode() + b"\0")
        if owner.__module__.split(".")[0] != PACKAGE.name:
            found.update(_source(owner))
    return found.hexdigest()[:8]


def _source(owner: Any) -> bytes:
    """The file in which something is written, or what is known of it where there is none."""
    try:
        return Path(inspect.getsourcefile(owner) or "").read_bytes()
    except (OSError, TypeError):
        code = getattr(owner, "__code__", None)
        return b"" if code is None else code.co_code + repr(code.co_consts).encode()


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
