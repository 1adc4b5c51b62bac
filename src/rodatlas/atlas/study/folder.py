"""The folder of a study: what is planned, and why tasks failed."""

from __future__ import annotations

import json
from pathlib import Path

from rodatlas.files import write_text

PLAN = "study.json"
PROGRESS = ".progress"
FAILURE = ".error.txt"


def run_of(folder: Path) -> str:
    """The mark of the run that is recorded in a folder, empty without one."""
    try:
        return str(json.loads((folder / PLAN).read_text())["run"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return ""


def write_failure(folder: Path, stem: str, error: str, trace: str) -> None:
    """Keep why a task failed: a line and the traceback, in a text file beside the results."""
    write_text(folder / f"{stem}{FAILURE}", f"{error}\n\n{trace}")


def failure_of(folder: Path, stem: str) -> str:
    """Why a task failed when it was last tried, in one line; empty if it did not."""
    try:
        return (folder / f"{stem}{FAILURE}").read_text().partition("\n")[0]
    except OSError:
        return ""


def forget_failure(folder: Path, stem: str) -> None:
    """The task has its result now."""
    (folder / f"{stem}{FAILURE}").unlink(missing_ok=True)
