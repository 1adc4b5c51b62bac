"""Models by name: those of the package, of installed packages that offer some, and of the running program.

A package offers a model by an entry point of the group 'rodatlas.models': its name, and the place of a function without
arguments that returns the model, 'mypackage.arches:arch'.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from importlib.metadata import entry_points

from rodatlas.continuation.checks import WrongInput, check_function, check_type
from rodatlas.model.model import Model

GROUP = "rodatlas.models"
BUILT_IN = {  # by place, for they stand above this folder
    "band": "rodatlas.paper.model:band", "rod": "rodatlas.rods.section_models:rectangular_rod",
    "elliptic-rod": "rodatlas.rods.section_models:elliptic_rod",
    "round-rod": "rodatlas.rods.section_models:round_rod", "given-rod": "rodatlas.rods.section_models:given_rod",
}  # fmt: skip
_KNOWN: dict[str, Model] = {}
_PLACES: dict[str, str] = {}


def register(make: Callable[[], Model]) -> Callable[[], Model]:
    """Make a model known by its name in this process, so that files with its results can be read; a decorator.

    Worker processes import the module of the function and make the model again.

    Parameters
    ----------
    make : function of a module, without arguments, that returns the model.

    Examples
    --------
    >>> @register
    ... def arch() -> Model:
    ...     return Model("arch", ...)
    >>> SliceSettings.of(model_named("arch"))
    """
    check_function("make", make)
    model = make()
    check_type("make", model, Model, "a function that returns a Model")
    place = f"{make.__module__}:{make.__qualname__}"
    if BUILT_IN.get(model.name, place) != place:
        raise WrongInput("name", f"expected one that is no model's of the package, got '{model.name}'")
    _KNOWN[model.name] = model
    _PLACES[model.name] = place

    @wraps(make)
    def known() -> Model:
        return model

    return known


def model_named(name: str, place: str = "") -> Model:
    """The model of a name.

    Parameters
    ----------
    place : of the function that makes it, 'module:function', where nobody may have registered it yet.

    Raises
    ------
    ValueError
        when nothing offers one.
    """
    if name not in _KNOWN:
        offered = {point.name: point.value for point in entry_points(group=GROUP)} | BUILT_IN
        where = offered.get(name) or place
        if not where:
            raise WrongInput("model", f"expected one of {', '.join(offered)}, got '{name}' (register makes one known)")
        module, _, attribute = where.partition(":")
        try:
            _KNOWN[name] = getattr(import_module(module), attribute)()
        except (ImportError, AttributeError) as error:
            raise WrongInput("model", f"expected one that can be made, got '{name}' of {where} ({error})") from None
        _PLACES[name] = where
    return _KNOWN[name]


def place_of(model: Model) -> str:
    """Where a model is made, as :func:`model_named` finds it in another process; '' where it is not registered."""
    return _PLACES.get(model.name, "") if _KNOWN.get(model.name) is model else ""
