"""How commands take their options: each value once, help that shows every default, -h as well as --help."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 120}


class Command(TyperCommand):
    """A command that refuses an option given twice where it takes one value."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _refuse_repeated(self, ctx, args)
        return super().parse_args(ctx, args)

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        return ["[OPTIONS]", *(str(a.metavar) for a in self.params if isinstance(a, TyperArgument))]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        arguments = [(str(a.metavar), f"{a.help}  [required]") for a in self.params if isinstance(a, TyperArgument)]
        for title, rows in (("Arguments", arguments), *self.sections(ctx)):
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)

    def sections(self, ctx: Any) -> list[tuple[str, list[tuple[str, str]]]]:
        """Options under their headings, each as it is typed and what it does."""
        return [("Options", records(self.get_params(ctx), ctx))]


def records(params: Iterable[Any], ctx: Any) -> list[tuple[str, str]]:
    """Options as they are typed, and what each does."""
    return [row for p in params if not isinstance(p, TyperArgument) and (row := p.get_help_record(ctx))]


class Group(TyperGroup):
    """The list of commands, what each does in full."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, str(command.help)) for name, command in self.commands.items()])


def _refuse_repeated(command: Command, context: Any, args: list[str]) -> None:
    """ValueError for an option that is given several values and takes one.

    The arguments are read once more, by a twin of the command whose options gather all their values.
    """
    twin, single, params = copy.copy(command), {}, []
    for known in command.get_params(context):
        one = copy.copy(known)
        if isinstance(one, TyperOption) and not (one.is_flag or one.multiple):
            one.multiple = True
            single[one.name] = one.opts[0].lstrip("-")
        params.append(one)
    twin.get_params = lambda ctx: params  # type: ignore[method-assign]
    values, _, _ = twin.make_parser(context).parse_args(args=list(args))
    for name, called in single.items():
        several = values.get(name)
        if isinstance(several, list | tuple) and len(several) > 1:
            raise ValueError(f"{called}: expected once, got {' and '.join(map(str, several))}")


def option(*names: str, kind: str, help: str, default: str = "") -> Any:
    """An option with a value.

    Parameters
    ----------
    names : as on the command line; from the name of the argument when left out.
    kind : of the value as the help calls it, one of :data:`KINDS`.
    default : in words, where it is not a value of the option itself.
    """
    text = f"{help}  [default: {default}]" if default else help
    return typer.Option(*names, metavar=kind, help=text, show_default=not default)


def argument(*, kind: str, help: str) -> Any:
    """A value without a name."""
    return typer.Argument(metavar=kind, help=help)


def flag(*names: str, help: str) -> Any:
    """An option without a value."""
    return typer.Option(*names, help=help)


def given(context: typer.Context) -> list[str]:
    """Names of the options that stand on the command line, without dashes."""
    return [
        p.opts[0].lstrip("-") for p in context.command.params
        if p.name is not None and (source := context.get_parameter_source(p.name)) is not None
        and source.name == "COMMANDLINE"
    ]  # fmt: skip


KINDS = {
    "NUMBER": "a number such as 0.5 or 1e-8", "INTEGER": "a whole number", "DEGREES": "an angle",
    "MM": "a length in mm", "RATIO": "a number or a fraction such as 1/80", "NAME": "a name",
    "FILE": "a file", "FILE.toml": "a file", "FOLDER": "a folder",
    "LxWxT": "length, width and thickness in mm such as 240x3x0.127",
    "SECTION": "a section such as rectangle:23.6", "VECTOR": "three numbers such as 0,0,-5",
    "ADDRESS": "tcp://host:port", "FORMAT": "csv, vtp, glb or stl", "CLASS": "+, - or both",
}  # fmt: skip
