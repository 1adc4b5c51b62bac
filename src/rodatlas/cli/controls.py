"""Options that a model declares: a command that is given one has an option for each of its controls."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rodatlas.cli.command import Command, option, records

if TYPE_CHECKING:
    from rodatlas.model import Control, Model, Setting

DEFAULT = "band"
_MODEL, _OPTIONS, _FIXED = "rodatlas.model", "rodatlas.options", "rodatlas.fixed"  # what a context remembers


class Fixed(NamedTuple):
    """The model that a command was given, and its controls.

    Attributes
    ----------
    texts : values of controls by name, as the user typed them; None where one was not given.
    """

    model: Model
    texts: Mapping[str, str | None]


class ModelCommand(Command):
    """A command that has --model besides its own options, and one for each control of the model that is named there."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        ctx.meta[_MODEL] = _named(args)
        return super().parse_args(ctx, args)

    def get_params(self, ctx: Any) -> list[Any]:
        own = super().get_params(ctx)
        taken = {name for p in own for name in p.opts}
        if clash := next((p.opts[0] for p in self._made(ctx) if p.opts[0] in taken), ""):
            raise ValueError(f"model: expected controls whose names are no options of the command, got {clash}")
        return [*self._made(ctx), *own]

    def sections(self, ctx: Any) -> list[tuple[str, list[tuple[str, str]]]]:
        _, *controls = self._made(ctx)
        others = [p for p in self.get_params(ctx) if all(p is not c for c in controls)]
        title = f"Controls of the {_model(ctx).name} that do not vary"
        return [(title, records(controls, ctx)), ("Options", records(others, ctx))]

    def invoke(self, ctx: Any) -> Any:
        texts = {p.opts[0].lstrip("-"): ctx.params.pop(p.name) for p in self._made(ctx)}
        del texts["model"]
        ctx.meta[_FIXED] = Fixed(_model(ctx), texts)
        return super().invoke(ctx)

    def _made(self, ctx: Any) -> list[Any]:
        """--model, and the options of the controls."""
        if _OPTIONS not in ctx.meta:
            ctx.meta[_OPTIONS] = _options(_model(ctx))
        found: list[Any] = ctx.meta[_OPTIONS]
        return found


def fixed_in(context: typer.Context) -> Fixed:
    """What a :class:`ModelCommand` was given."""
    found: Fixed = context.meta[_FIXED]
    return found


def _model(context: typer.Context) -> Model:
    from rodatlas.model import model_named

    return model_named(context.meta.get(_MODEL, DEFAULT))


def _named(args: list[str]) -> str:
    """The name behind --model, which has to be known before the other options are."""
    pairs = zip(args, [*args[1:], DEFAULT], strict=False)  # none where there are no arguments
    given = [(arg, after) for arg, after in pairs if arg.partition("=")[0] == "--model"]
    found = [arg.partition("=")[2] if "=" in arg else after for arg, after in given]
    if len(found) > 1:
        raise ValueError(f"model: expected once, got {' and '.join(found)}")
    return found[0] if found else DEFAULT


def _options(model: Model) -> list[Any]:
    """--model, and an option for each control: first the one that stands first in names, then as the model has them."""
    usual, controls = model.setting(), sorted(model.controls, key=lambda c: c.short != "")

    def takes() -> None:
        """Nothing of it is wanted but what its signature makes."""

    named = option("--model", kind="NAME", help="What is computed; an installed package may offer more.")
    parameters = [
        Parameter("model", Parameter.KEYWORD_ONLY, default=DEFAULT, annotation=Annotated[str, named]),
        *(Parameter(c.name.replace("-", "_"), Parameter.KEYWORD_ONLY, default=None, annotation=_annotation(c, usual))
          for c in controls),
    ]  # fmt: skip
    takes.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    takes.__annotations__ = {p.name: p.annotation for p in parameters}
    made = typer.Typer(add_completion=False)
    made.command()(takes)
    return [p for p in typer.main.get_command(made).params if p.name in takes.__annotations__]


def _annotation(control: Control, usual: Setting) -> Any:
    """Of an option such as '--angle DEGREES  Clamp angle: degrees with 0 <= angle < 90.  [default: none]'."""
    value = "none" if control.short == "" else f"{control.default:g}"
    default = "as the others say" if control.derived else value
    what = control.what or control.name
    text = f"{what[:1].upper()}{what[1:]}: {control.range_text(usual)}."
    kind = "DEGREES" if control.unit == "deg" else "NUMBER"
    return Annotated[str | None, option(f"--{control.name}", kind=kind, help=text, default=default)]
