"""Keep a file that cannot be used, under another name."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any


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


def keep_other_json(path: Path, is_ours: Callable[[Any], bool]) -> Path | None:
    """Make way for a JSON file: what else has its name is renamed, as by :func:`set_aside`.

    Parameters
    ----------
    is_ours : whether the value in a file may be replaced.

    Returns
    -------
    the new path of what was renamed, if anything was.
    """
    if not path.is_file():
        return None
    try:
        if is_ours(json.loads(path.read_text(encoding="utf-8"))):
            return None
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        pass  # no JSON, or of another form
    return set_aside(path, "other")
