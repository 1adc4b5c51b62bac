"""Options of commands with those that a model adds, as help pages have them."""

from typing import Any

from typer.core import TyperOption

from rodatlas.cli.command import CONTEXT
from rodatlas.cli.entry import command

COMMANDS = command().commands


def options_of(name: str) -> list[Any]:
    """All options of a command but --help."""
    one = COMMANDS[name]
    params = one.get_params(one.context_class(one, **CONTEXT))
    return [p for p in params if isinstance(p, TyperOption) and p.name != "help"]
