"""What the atlas needs to know of a problem, and nothing else: a `Model` is passed to everything above the engine.

`control` (what can be varied, in the user's units), `setting` (values of all controls), `quantity` (what a diagram can
show), `model` (the value that holds them with the boundary value problem), `orbit` (which solutions are one state up to
the symmetries of a setting), `nomenclature` (who names states and numbers bifurcations), `registry` (models by name).
"""

from rodatlas.model.control import Control
from rodatlas.model.model import Model, Seed, Source
from rodatlas.model.nomenclature import Nomenclature, Part
from rodatlas.model.quantity import Invariant, Quantity
from rodatlas.model.registry import model_named, register
from rodatlas.model.setting import Setting, View

__all__ = [
    "Control", "Invariant", "Model", "Nomenclature", "Part", "Quantity", "Seed", "Setting", "Source", "View",
    "model_named", "register",
]  # fmt: skip
