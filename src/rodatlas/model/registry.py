"""Models by name: those of the package, of installed packages that offer some, and of the running program.

A package offers a model by an entry point of the group 'rodatlas.models': its name, and the place of a function without
arguments that returns the model, 'mypackage.arches:arch'.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.metadata import entry_points

from rodatlas.continuation.checks import check_type
from rodatlas.model.model import Model

GROUP = "rodatlas.models"
BUILT_IN = {"band": "rodatlas.paper.model:band"}  # by place, for it stands above this folder
_REGISTERED: dict[str, Callable[[], Model]] = {}


def register(model: Model) -> Model:
    """Make a model known by its name in this process, so that files with its results can be read; the model."""
    check_type("model", model, Model, "a Model")
    _REGISTERED[model.name] = lambda: model
    return model


def model_named(name: str) -> Model:
    """The model of a name.

    Raises
    ------
    ValueError
        when nothing offers one.
    """
    if name in _REGISTERED:
        return _REGISTERED[name]()
    offered = {point.name: point.value for point in entry_points(group=GROUP)} | BUILT_IN
    if name not in offered:
        known = ", ".join([*offered, *_REGISTERED])
        raise ValueError(f"model: expected one of {known}, got '{name}' (rodatlas.model.register makes one known)")
    module, _, attribute = offered[name].partition(":")
    return register(getattr(import_module(module), attribute)())
