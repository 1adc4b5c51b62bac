"""The entry point: how errors reach the user, in one line on stderr and an exit code."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any, NoReturn

import typer

from rodatlas.cli.app import app
from rodatlas.failures import Failure

FAILED, WRONG, FAULT, INTERRUPTED = 1, 2, 70, 130
TRACEBACK = "RODATLAS_TRACEBACK"  # environment variable that asks for the traceback of whatever goes wrong
LONGEST = 2000  # characters of a line


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command; exit codes are those that `rodatlas --help` lists.

    Whatever goes wrong is one line on stderr; with RODATLAS_TRACEBACK=1 in the environment its traceback comes before.
    """
    try:
        given = None if arguments is None else list(arguments)
        code = command()(args=given, prog_name="rodatlas", standalone_mode=False)
        sys.stdout.flush()
    except (KeyboardInterrupt, typer.Abort):
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        _leave_stdout()  # who read the output has enough of it, `head` say
        sys.exit(FAILED)
    except Exception as error:
        if os.environ.get(TRACEBACK):
            traceback.print_exc()
        _fail(*_told(error))
    sys.exit(code if isinstance(code, int) else 0)


@cache
def command() -> Any:
    """The commands, put together from their functions once."""
    return typer.main.get_command(app)


def _told(error: Exception) -> tuple[str, int]:
    """What is said of an error, and the exit code."""
    if hasattr(error, "format_message"):  # wrong usage comes as an exception that formats its own message
        return error.format_message(), WRONG
    if isinstance(error, Failure):
        return str(error), FAILED
    if isinstance(error, MemoryError):
        return f"memory: expected enough for this, got too little ({error or 'MemoryError'})", FAILED
    if isinstance(error, UnicodeError):
        return f"text: expected UTF-8, got something else ({error})", WRONG
    if isinstance(error, OSError):
        return _of_system(error), WRONG
    if isinstance(error, ValueError) and type(error).__module__.partition(".")[0] in ("builtins", "rodatlas"):
        return str(error), WRONG
    kind = type(error).__name__
    return f"fault of the program: {kind}: {error}; {TRACEBACK}=1 shows where it came from", FAULT


def _of_system(error: OSError) -> str:
    """What the operating system refuses: a file with its name, or the output itself."""
    why = error.strerror or str(error)
    if error.filename is not None:
        return f"file: expected one that can be read and written, got '{error.filename}' ({why})"
    _leave_stdout()
    return f"output: expected room and a place to write to, got an error ({why})"


def _leave_stdout() -> None:
    """Let the rest of the output go nowhere, so that Python does not complain of it at the end."""
    with suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _fail(message: str, code: int) -> NoReturn:
    line = " ".join(message.split())
    line = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)
    if len(line) > LONGEST:
        line = f"{line[:LONGEST]}..."
    print(f"rodatlas: {line}", file=sys.stderr)
    sys.exit(code)
