"""Options that a model declares: a command that is given one has an option for each of its controls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from inspect import Parameter, Signature
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rodatlas.cli.command import Command, option, records
from rodatlas.cli.common import number, shown

if TYPE_CHECKING:
    from rodatlas.model import Control, Model, Setting

DEFAULT, LOADED = "band", "rod"
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
        ctx.meta[_MODEL] = _chosen(args)
        return super().parse_args(ctx, args)

    def get_params(self, ctx: Any) -> list[Any]:
        own = super().get_params(ctx)
        taken = {name for p in own for name in p.opts}
        if clash := next((p.opts[0] for p in self._made(ctx) if p.opts[0] in taken), ""):
            raise ValueError(f"model: expected controls whose names are no options of the command, got {clash}")
        return [*self._made(ctx), *own]

    def sections(self, ctx: Any) -> list[tuple[str, list[tuple[str, str]]]]:
        controls = [p for p in self._made(ctx) if p.opts[0].lstrip("-") in {c.name for c in _model(ctx).controls}]
        others = [p for p in self.get_params(ctx) if all(p is not c for c in controls)]
        title = f"Controls of the {_model(ctx).name} that do not vary"
        return [(title, records(controls, ctx)), ("Options", records(others, ctx))]

    def invoke(self, ctx: Any) -> Any:
        typed = {p.opts[0].lstrip("-"): ctx.params.pop(p.name) for p in self._made(ctx)}
        ctx.meta[_FIXED] = Fixed(_model(ctx), _with_groups(_model(ctx), typed))
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


def _chosen(args: list[str]) -> str:
    """The model of --model or --section, which has to be known before the other options are.

    Without either it is the band, and the rod where something is given or varies that the band has not: a weight, say.
    """
    named, section = (_given(args, f"--{name}") for name in ("model", "section"))
    if named and section:
        raise ValueError(f"section: expected none beside --model, got '{shown(section[0])}'")
    if section:
        from rodatlas.rods.section_models import model_of_section

        return model_of_section(section[0])[0]
    if named:
        return named[0]
    told = {arg.partition("=")[0].removeprefix("--") for arg in args if arg.startswith("--")}
    varied = (_given(args, f"--{name}") for name in ("along", "in"))
    told |= {name.strip() for texts in varied for text in texts for name in text.split(",")}
    return LOADED if told & (_names(LOADED) - _names(DEFAULT)) else DEFAULT


def _names(model: str) -> set[str]:
    """Names of the controls of a model, and of its groups of them."""
    from rodatlas.model import model_named

    found = model_named(model)
    return {c.name for c in found.controls} | set(found.groups)


def _given(args: list[str], name: str) -> list[str]:
    """Values of an option that has to be read before all others."""
    found: list[str] = []
    for i, arg in enumerate(args):
        if arg.startswith(f"{name}="):
            found.append(arg.partition("=")[2])
        elif arg == name:
            found += args[i + 1 : i + 2]  # none at the end, as the parser will say
    if len(found) > 1:
        raise ValueError(f"{name[2:]}: expected once, got {' and '.join(map(shown, found))}")
    return found


def _with_groups(model: Model, typed: Mapping[str, str | None]) -> dict[str, str | None]:
    """Values of controls, those of a section and of groups among them."""
    texts = {c.name: typed.get(c.name) for c in model.controls}
    told: dict[str, tuple[str, str]] = {}
    if typed.get("section"):
        from rodatlas.rods.section_models import model_of_section

        values = model_of_section(str(typed["section"]))[1]
        told |= {name: ("section", repr(value)) for name, value in values.items()}
    for group, names in model.groups.items():
        if (text := typed.get(group)) is not None:
            parts = text.split(",")
            if len(parts) != len(names):
                raise ValueError(f"{group}: expected {len(names)} numbers such as 0,0,-5, got '{shown(text)}'")
            told |= {name: (group, part) for name, part in zip(names, parts, strict=True)}
            for part in parts:
                number(group, part)
    for name, (by, text) in told.items():
        if texts[name] is not None:
            raise ValueError(f"{name}: expected none beside --{by}, got '{shown(str(texts[name]))}'")
        texts[name] = text
    return texts


def _options(model: Model) -> list[Any]:
    """--model, --section, an option for each group of controls, and one for each control: first the one that stands
    first in names, then as the model has them."""
    usual, controls = model.setting(), sorted(model.controls, key=lambda c: c.short != "")

    def takes() -> None:
        """Nothing of it is wanted but what its signature makes."""

    more = "What is computed; an installed package may offer more than band, rod, elliptic-rod, round-rod, given-rod."
    section = "Section: rectangle:D/t, square, ellipse:D/t, circle, tube, a:A or a:A,b:B (EI1/GJ, EI2/GJ)."
    annotations = {
        "model": Annotated[str | None, option("--model", kind="NAME", help=more, default=DEFAULT)],
        "section": Annotated[
            str | None, option("--section", kind="SECTION", help=section, default="the thin band, b infinite")
        ],
        **{group: _group(group, names, usual) for group, names in (model.groups or _groups_of_rods()).items()},
        **{c.name.replace("-", "_"): _annotation(c, usual) for c in controls},
    }
    parameters = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=None, annotation=kind) for name, kind in annotations.items()
    ]
    takes.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    takes.__annotations__ = annotations
    made = typer.Typer(add_completion=False)
    made.command()(takes)
    return [p for p in typer.main.get_command(made).params if p.name in annotations]


def _groups_of_rods() -> Mapping[str, Sequence[str]]:
    from rodatlas.model import model_named

    return model_named(LOADED).groups


def _group(group: str, names: Sequence[str], usual: Setting) -> Any:
    """Of an option such as '--gravity X,Y,Z', several controls at once."""
    parts = [name.removeprefix(f"{group}-") for name in names]
    what = {"gravity": "Weight of the rod as a vector, GJ/L^2", "rest": "Curvatures and twist without load, 1/L"}
    text = f"{what.get(group, group.capitalize())}: {', '.join(f'{group}-{part}' for part in parts)}."
    default = ",".join(f"{usual[name]:g}" if name in usual else "0" for name in names)
    return Annotated[str | None, option(f"--{group}", kind="VECTOR", help=text, default=default)]


def _annotation(control: Control, usual: Setting) -> Any:
    """Of an option such as '--angle DEGREES  Clamp angle: degrees with 0 <= angle < 90.  [default: none]'."""
    value = "none" if control.short == "" else f"{control.default:g}"
    default = "as the others say" if control.derived else value
    what = control.what or control.name
    text = f"{what[:1].upper()}{what[1:]}: {control.range_text(usual)}."
    kind = "DEGREES" if control.unit == "deg" else "NUMBER"
    return Annotated[str | None, option(f"--{control.name}", kind=kind, help=text, default=default)]
