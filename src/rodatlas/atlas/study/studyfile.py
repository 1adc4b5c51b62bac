"""Study files: TOML with tables of settings, each value one, a list or a grid.

Every table `[[slices]]`, `[[states]]`, `[[loci]]`, `[[phases]]` stands for the tasks of all combinations of its values;
several tables, and what they require, are put together, each task once. What a table may hold follows from
`Kind.parameters` and the controls of the model that it names, so that neither a new kind of task nor a new control
needs a change here. Errors name the file and the path of the
value:
``study.toml: slices[0].angle: expected a number, got 'x'``.
"""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    StrictBool,
    StrictFloat,
    StrictInt,
    StrictStr,
    Tag,
    ValidationError,
    create_model,
    model_validator,
)

from rodatlas.atlas.study.cluster_settings import ClusterSettings
from rodatlas.atlas.study.kinds import KINDS, Kind
from rodatlas.atlas.study.kinds.base import BAND, REQUIRED, Parameter
from rodatlas.atlas.study.plan import Study
from rodatlas.atlas.study.task import Task, task_of, with_requirements
from rodatlas.continuation.checks import WrongInput
from rodatlas.model import model_named

MOST = 100_000  # tasks of one study, against slips of the pen in grids
_IN_FILES = {"tol": "tolerance", "class": "classes"}  # names that settings and commands have for these
DIGITS = 12  # to which grid values are rounded, so that 0.3 + 0.1 is 0.4


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Grid(_Model):
    """Equidistant numbers, both ends included: {from, to, count} or {from, to, step}."""

    first: StrictFloat = Field(alias="from", allow_inf_nan=False)
    to: StrictFloat = Field(allow_inf_nan=False)
    count: StrictInt | None = Field(default=None, ge=2, le=MOST)
    step: StrictFloat | None = Field(default=None, gt=0.0, allow_inf_nan=False)

    @model_validator(mode="after")
    def _check(self) -> Grid:
        if (self.count is None) == (self.step is None):
            raise ValueError("expected either count or step beside from and to")
        if self.step is not None:
            if (self.to - self.first) * self.step < 0:
                raise ValueError(f"expected a range that increases, got from {self.first:g} to {self.to:g}")
            parts = (self.to - self.first) / self.step
            if parts > MOST or abs(parts - round(parts)) > 1e-9 * max(1.0, parts):
                raise ValueError(
                    f"expected a step that divides the range of {self.to - self.first:g} into at most {MOST} parts, "
                    f"got {self.step:g}"
                )
        return self

    def values(self) -> list[float]:
        """The numbers, rounded to 12 digits after the point."""
        count = self.count if self.count is not None else round((self.to - self.first) / (self.step or 1.0)) + 1
        return [round(float(x), DIGITS) for x in np.linspace(self.first, self.to, count)]


def read_study(path: Path) -> Study:
    """The study that a file describes.

    Raises
    ------
    ValueError
        in one line, for a file that cannot be read, and with the path of every value that is wrong.
    """
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a name that the system does not take
        why = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"study: expected a file that can be read, got '{path}' ({why})") from None
    try:
        data = tomllib.loads(content.decode("utf-8").replace("\r\n", "\n"))
    except RecursionError:
        raise ValueError(f"{path.name}: expected TOML, got tables or lists in each other without end") from None
    except ValueError as error:
        raise ValueError(f"{path.name}: expected TOML, got something else: {error}") from None
    return parse_study(data, path.name, path.stem)


def parse_study(data: Mapping[str, Any], source: str = "study", name: str = "study") -> Study:
    """The study that a mapping describes, as :func:`read_study`.

    Parameters
    ----------
    source : stands before every error.
    name : of a study that has none.
    """
    try:
        model: Any = _model(_models_in(data)).model_validate(data)
    except ValidationError as error:
        raise ValueError("; ".join(f"{source}: {line}" for line in _lines(error, _models_in(data)))) from None
    tasks: list[Task] = []
    errors: dict[str, None] = {}
    for kind in KINDS:
        for number, table in enumerate(getattr(model, kind.section)):
            _add_tasks(kind, table, f"{source}: {kind.section}[{number}]", tasks, errors)
    cluster = None
    if model.cluster is not None:
        try:
            cluster = ClusterSettings(**model.cluster.model_dump())
        except WrongInput as error:
            errors[f"{source}: cluster.{error}"] = None
    if errors:
        raise ValueError("; ".join(errors))
    if not tasks:
        sections = ", ".join(f"[[{kind.section}]]" for kind in KINDS)
        raise ValueError(f"{source}: expected at least one table of {sections}, got none")
    return Study(model.name or name, with_requirements(tasks), model.retries, cluster)


def _add_tasks(kind: Kind, table: BaseModel, place: str, tasks: list[Task], errors: dict[str, None]) -> None:
    """The tasks of one table: all combinations; what settings refuse becomes an error with its place."""
    given = {name: _values(getattr(table, name)) for name in table.model_fields_set}
    total = int(np.prod([float(len(values)) for values in given.values()]))
    if total + len(tasks) > MOST:
        errors[f"{place}: expected at most {MOST} tasks in all, got {total + len(tasks)}"] = None
        return
    for combination in itertools.product(*given.values()):
        try:
            tasks.append(task_of(kind.make(**dict(zip(given, combination, strict=True))), kind))
        except WrongInput as error:
            name = _IN_FILES.get(error.field, error.field.replace("-", "_"))
            errors[f"{place}.{name}: {error.rest}"] = None
        except ValueError as error:  # of more than one value
            errors[f"{place}: {error}"] = None


def _values(value: Any) -> Sequence[Any]:
    """The values that a table gives for one name."""
    if isinstance(value, Grid):
        return value.values()
    return value if isinstance(value, list) else [value]


# -- models from the parameters of Kind.make --------------------------------------------------------------------------

_TYPES: dict[Any, Any] = {
    float: Annotated[StrictFloat, Field(allow_inf_nan=False)], int: StrictInt, bool: StrictBool, str: StrictStr,
    tuple[str, ...]: tuple[StrictStr, ...],
}  # fmt: skip


def _models_in(data: Mapping[str, Any]) -> frozenset[str]:
    """Names of the models of all tables, as far as there are such models; the others are told of later."""
    names = {BAND}
    for kind in KINDS:
        tables = data.get(kind.section)
        for table in tables if isinstance(tables, list) else ():
            named = table.get("model") if isinstance(table, dict) else None
            names |= {name for name in (named if isinstance(named, list) else [named]) if isinstance(name, str)}
    return frozenset(name for name in names if _is_model(name))


def _is_model(name: str) -> bool:
    try:
        model_named(name)
    except ValueError:
        return False
    return True


@cache
def _model(models: frozenset[str]) -> type[BaseModel]:
    """The model of a study file whose tables name some models of the atlas."""
    tables: dict[str, Any] = {"cluster": (_cluster() | None, None)}
    tables |= {kind.section: (list[_table(kind, models)], []) for kind in KINDS}  # type: ignore[misc]
    return create_model(
        "StudyFile", __base__=_Model, name=(StrictStr, ""), retries=(Annotated[StrictInt, Field(ge=0, le=10)], 2),
        **tables,
    )  # fmt: skip


@cache
def _cluster() -> type[BaseModel]:
    """The model of a `[cluster]` table: a field for each of its settings, which check what their values may be."""
    types = get_type_hints(ClusterSettings)
    named: dict[str, Any] = {
        f.name: (_TYPES[types[f.name]], ... if f.default is MISSING else f.default) for f in fields(ClusterSettings)
    }
    return create_model("cluster", __base__=_Model, **named)


def _parameters(kind: Kind, models: Iterable[str]) -> dict[str, Parameter]:
    """What tables of one kind may hold."""
    return {name: p for model in sorted(models) for name, p in kind.parameters(model_named(model)).items()}


def _table(kind: Kind, models: Iterable[str]) -> type[BaseModel]:
    """The model of a table of one kind: a field for each parameter."""
    named: dict[str, Any] = {}
    for name, (plain, default) in _parameters(kind, models).items():
        named[name] = (_choice(plain), ... if default is REQUIRED else default)
    return create_model(kind.section, __base__=_Model, **named)


def _choice(plain: type) -> Any:
    """One value, a list of values, or for numbers a grid."""
    one = _TYPES[plain]
    many: Any = Annotated[list[one], Field(min_length=1)]  # type: ignore[valid-type]
    choices: Any = Annotated[one, Tag("one")] | Annotated[many, Tag("list")]
    if plain is float:
        choices = choices | Annotated[Grid, Tag("grid")]
    tags: dict[Any, str] = {list: "list", dict: "grid" if plain is float else "one"}
    return Annotated[choices, Discriminator(lambda value: tags.get(type(value), "one"))]


# -- errors -----------------------------------------------------------------------------------------------------------

_TAGS = ("one", "list", "grid")
_EXPECTED = {
    "float_type": "a number, a list of numbers or a grid {from, to, count}", "int_type": "a whole number",
    "bool_type": "true or false", "string_type": "a text in quotes", "list_type": "tables in double brackets",
    "missing": "a value", "finite_number": "a finite number", "too_short": "at least one value",
    "model_type": "a table", "model_attributes_type": "a table", "tuple_type": "a list",
}  # fmt: skip
_BOUNDS = {"ge": "a number of at least", "le": "a number of at most", "gt": "a number above"}


def _lines(error: ValidationError, models: frozenset[str]) -> Iterable[str]:
    """One line for every error: its path, what was expected and what came."""
    for e in error.errors():
        path = _path(e["loc"])
        kind, got = e["type"], e["input"]
        if kind == "extra_forbidden":
            yield f"{path}: expected one of {', '.join(_names(e['loc'], models))}, got another name"
        elif kind == "value_error":
            yield f"{path}: {e['ctx']['error']}"
        elif kind == "missing":
            yield f"{path}: expected a value, got none"
        else:
            bounds = e.get("ctx", {})
            number = " and ".join(f"{words} {bounds[key]:g}" for key, words in _BOUNDS.items() if key in bounds)
            yield f"{path}: expected {_EXPECTED.get(kind) or number or 'another value'}, got {got!r}"


def _names(location: Sequence[str | int], models: frozenset[str]) -> Iterable[str]:
    """The names that may stand where an unknown one does."""
    if len(location) == 1:
        return _model(models).model_fields
    if "grid" in location:
        return "from", "to", "count", "step"
    kind = next((k for k in KINDS if k.section == location[0]), None)
    return _parameters(kind, models) if kind is not None else _cluster().model_fields


def _path(location: Iterable[str | int]) -> str:
    """'slices[0].angle' of ('slices', 0, 'angle'); tags of choices are left out."""
    text = ""
    for part in location:
        if isinstance(part, int):
            text += f"[{part}]"
        elif part not in _TAGS:
            text += f".{part}" if text else part
    return text
