"""The value that is passed everywhere above the engine: a boundary value problem and what is asked about it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from rodatlas.continuation import BVP, Branch, Solution
from rodatlas.continuation.checks import WrongInput, check_type
from rodatlas.files import exact
from rodatlas.files.code import code_of
from rodatlas.model.control import Control
from rodatlas.model.quantity import Invariant, Quantity
from rodatlas.model.setting import Setting
from rodatlas.progress import Progress

if TYPE_CHECKING:
    from rodatlas.model.nomenclature import Nomenclature

DEFAULT = "band"  # the model whose name is left out of names of files
Keep = Callable[[str, Callable[[], Branch]], Branch]
"""Gives the branch of a name that an earlier run has finished, or makes it and keeps it."""


class Seed(NamedTuple):
    """A solution at which a branch starts, and the name that the branch gets. It may belong to another setting of the
    model: then it is followed to the one that is wanted, and dropped when it ends on the way."""

    name: str
    solution: Solution


class Source(NamedTuple):
    """One kind of starts: its name, and a function of (setting, tolerance, keep) that gives seeds and warnings."""

    name: str
    find: Callable[[Setting, float, Keep], tuple[list[Seed], list[str]]]


class Search(Protocol):
    """A search for stable states at one setting that knows nothing of branches.

    Attributes
    ----------
    names : whether it names what it finds as a slice does.
    """

    names: bool

    def stable_states(self, setting: Setting, starts: int, seed: int, tolerance: float) -> tuple[Solution, ...]:
        """Stable states, one of each orbit."""

    def discover(self, setting: Setting, starts: int | None, tolerance: float, progress: Progress | None) -> Any:
        """Stable states with their names, as a :class:`rodatlas.states.Discovery`; without `starts` until it looks
        complete."""

    def starts_branch(self, solution: Solution) -> bool:
        """Whether a state that is on no known branch starts one: not those of families without an end."""

    def meets(self, solution: Solution) -> bool:
        """Whether the search is meant to find a state that is known from a branch."""


@dataclass(frozen=True, eq=False)
class Model:
    """A problem, its controls, how its solutions are read and compared, and where its branches start.

    Attributes
    ----------
    name : under which it is known to files and commands.
    build : makes the boundary value problem, once, when it is needed.
    controls : what can be varied. A state of another setting is carried to one control by control, in this order.
    quantities : what diagrams can be drawn against; the first one by default.
    sources : where branches start.
    free : parameters that are unknown on every branch.
    index : Morse index of a solution, None where it cannot be counted; without it no state is called stable.
    pairing : symmetries that make of a state the other members of it, 'US+' and 'US-'. By default those that change no
        parameter. Other symmetries that leave a setting alone map it to itself: they make of a branch another branch.
    invariants : numbers that tell states at one setting apart, equal for all members; without them whole solutions are
        compared.
    decisive : whether invariants are enough to call two states one; else whole solutions are compared besides.
    references : settings from which states are carried over, for what is not connected within a diagram.
    search : finds stable states; None where nothing does.
    nomenclature : gives names and numbers; None: they are made of what is seen.
    sign : tells the two members of a pair apart, '+' or '-'; None: by where the unknowns are larger.
    order : one or two observables by which states of one name are numbered, the second where the first is equal; the
        first quantity by default.
    ribbon : reads a solution as a shape, None for what has none (see :class:`rodatlas.rods.RodState`).
    width : of the band over its length, for drawings and the test for self-contact; 0 for a line.
    groups : names under which several controls are given at once, such as the components of a vector.

    Examples
    --------
    The arch of the engine's examples, with its load as control:

    >>> load = Control("load", "q", "q/\\pi^4", 0.0, scale=np.pi**-4, usual=lambda setting: (-5.0, 15.0))
    >>> model = Model("arch", arch, (load,), (Quantity.of("a"),), (Source("unloaded", starts),), free=("N",))
    """

    name: str
    build: Callable[[], BVP]
    controls: tuple[Control, ...]
    quantities: tuple[Quantity, ...]
    sources: tuple[Source, ...]
    free: tuple[str, ...] = ()
    index: Callable[[Solution], int | None] | None = None
    pairing: tuple[str, ...] | None = None
    invariants: tuple[Invariant, ...] = ()
    decisive: bool = True
    references: Callable[[Setting, str], Sequence[Setting]] | None = None
    search: Search | None = None
    nomenclature: Nomenclature | None = None
    sign: Callable[[Solution], str] | None = None
    order: tuple[str, ...] = ()
    ribbon: Callable[[Solution], Any] | None = None
    width: float = 0.0
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, kind in (("controls", Control), ("quantities", Quantity), ("sources", Source)):
            values = getattr(self, name)
            if not values:
                raise WrongInput(name, f"expected at least one {kind.__name__}, got none")
            for value in values:
                check_type(name, value, kind, f"{kind.__name__} objects")
        self._check_controls()
        if wrong := [n for names in self.groups.values() for n in names if n not in {c.name for c in self.controls}]:
            raise WrongInput("groups", f"expected names of controls, got '{wrong[0]}'")
        for kept in ("controls", "quantities", "sources"):
            names = [value.name for value in getattr(self, kept)]
            if twice := next((name for name in names if names.count(name) > 1), ""):
                raise WrongInput(kept, f"expected names of their own, got '{twice}' twice")
        if "/" in self.name or not self.name.strip():
            raise WrongInput("name", f"expected a name that can be part of a file's, got '{self.name}'")

    def _check_controls(self) -> None:
        """Every parameter has one control that is not derived, and those that a control is added to come before it."""
        held = [c for c in self.controls if not c.derived]
        if not held:
            raise WrongInput("controls", "expected one that is not derived, got none")
        before: dict[str, Control] = {}
        for control in held:
            if control.parameter in before:
                raise WrongInput("controls", f"expected one for each parameter, got two for '{control.parameter}'")
            before[control.parameter] = control
        for control in self.controls:
            if control.scale == 0.0 or (control.unit == "deg" and control.scale != 1.0):
                what = "a scale that is not 0, and none in degrees"
                raise WrongInput("controls", f"expected {what}, got {control.scale:g} for {control.name}")
            if control.derived:
                known = before.get(control.parameter)
                alike = known is not None and (known.unit, known.scale) == (control.unit, control.scale)
                if not alike or any(name not in before for name in control.added):
                    what = f"controls in one unit for what {control.name} is derived from"
                    raise WrongInput("controls", f"expected {what}, got none")
            elif control.added:
                raise WrongInput("controls", f"expected none that is added to others but derived, got {control.name}")

    def __reduce__(self) -> tuple[Any, ...]:
        """To another process a model goes by its name: functions of a module cannot be sent."""
        from rodatlas.model.registry import model_named, place_of

        if not (place := place_of(self)):
            raise ValueError(f"model: expected one that is registered, as other processes need it, got {self!r}: see "
                             "rodatlas.model.register")  # fmt: skip
        return model_named, (self.name, place)

    def identity(self) -> dict[str, object]:
        """Name; and, unless its code is part of the package, digests of the problem and of what else is its own."""
        from rodatlas.continuation.problem.fingerprint import fingerprint
        from rodatlas.model.registry import place_of

        own = place_of(self).startswith("rodatlas.")
        found: dict[str, object] = {"model": self.name}
        if own:
            return found
        plain = [repr((c.name, c.parameter, c.unit, c.scale, c.origin, c.added, c.default)) for c in self.controls]
        plain += [repr((self.free, self.pairing, self.invariants, self.order, self.width))]
        digests = {"problem": fingerprint(self.problem), "functions": code_of(*self._functions())}
        return {**found, **digests, "controls": plain}

    def _functions(self) -> list[Any]:
        """All that is called."""
        of_controls = [f for c in self.controls for f in (c.limits, c.usual, c.wide)]
        own = [self.build, self.index, self.sign, self.references, self.search, self.nomenclature, self.ribbon]
        return [*own, *(s.find for s in self.sources), *(q.read for q in self.quantities), *of_controls]

    def __repr__(self) -> str:
        return f"Model({self.name}: controls {', '.join(c.name for c in self.controls)})"

    @cached_property
    def problem(self) -> BVP:
        """The boundary value problem, which must have all that the model speaks of."""
        found = self.build()
        known: dict[str, tuple[Collection[str], Sequence[str]]] = {
            "controls": (found.parameters, [p for c in self.controls for p in (c.parameter, *c.added)]),
            "free": (found.parameters, self.free), "pairing": (found.symmetries, self.pairing or ()),
            "invariants": (found.observables, [x.name for x in self.invariants]),
            "order": (found.observables, self.order),
        }  # fmt: skip
        for told, (there, wanted) in known.items():
            if missing := [name for name in wanted if name not in there]:
                raise WrongInput(told, f"expected names of the problem, {', '.join(there)}, got '{missing[0]}'")
        return found

    def restricted(self, group: Sequence[str]) -> Model:
        """The model with these pairing symmetries only: those that a whole diagram has.

        At single places of it there may be more; images under these are states of their own all the same.
        """
        from rodatlas.model.orbit import pairing

        if set(group) == set(pairing(self)):
            return self
        found = replace(self, pairing=tuple(group), decisive=False)
        found.__dict__["problem"] = self.problem  # traced once
        return found

    # -- controls and quantities --------------------------------------------------------------------------------------

    def control(self, name: str, field: str = "control") -> Control:
        """A control by name; ValueError lists them."""
        known = {c.name: c for c in self.controls}
        if name not in known:
            raise WrongInput(field, f"expected one of {', '.join(known)}, got '{name}'")
        return known[name]

    def quantity(self, name: str, field: str = "against") -> Quantity:
        """A quantity by name; ValueError lists them."""
        known = {q.name: q for q in self.quantities}
        if name not in known:
            raise WrongInput(field, f"expected one of {', '.join(known)}, got '{name}'")
        return known[name]

    @property
    def plane(self) -> tuple[str, str]:
        """The controls of the plane that is looked at by default, the one along slices last."""
        held = [c for c in self.controls if not c.derived]
        first = [c.name for c in held if c.short == ""]
        return (first or [c.name for c in held[:-1]] or [""])[-1], held[-1].name

    def setting(self, **values: float) -> Setting:
        """Values of all controls, those that are not given by default; underscores stand for dashes in their names.

        A derived control says what a control of the same parameter is; both have one unit.

        Raises
        ------
        ValueError
            for a control that there is not, or a value outside its limits.
        """
        given = [(self.control(name.replace("_", "-")), value) for name, value in values.items()]
        found = {c.name: c.default for c in self.controls if not c.derived}
        found |= {c.name: value for c, value in given if not c.derived}
        for control, value in ((c, value) for c, value in given if c.derived):
            control.check(value, found)
            if twice := next((c.name for c, _ in given if c is not control and c.parameter == control.parameter), ""):
                raise WrongInput(control.name, f"expected none beside {twice}, which says the same, got {value:g}")
            added = (c.name for c in self.controls if c.parameter in control.added and not c.derived)
            found[self.holder(control.name).name] = float(value) - sum(found[name] for name in added)
        told = {c.name for c, _ in given}
        for name in sorted(found, key=lambda name: name not in told):  # a default is not to blame for a given value
            self.control(name).check(found[name], found)
        return Setting(found)

    def refuse_moved(self, varying: Control, values: Mapping[str, float]) -> None:
        """Raise for a value of a derived control that would change as another one varies.

        Raises
        ------
        WrongInput
            naming the control that holds still instead.
        """
        for name in values:
            control = self.control(name.replace("_", "-"))
            if control.derived and varying.parameter in control.added:
                held = self.holder(control.name).name
                what = f"none where {varying.name} varies, since it would vary too: give {held}, which stays"
                raise WrongInput(control.name, f"expected {what}, got {values[name]:g}")

    def holder(self, control: str) -> Control:
        """The control that settings hold for the parameter of a control: itself, unless it is derived."""
        parameter = self.control(control).parameter
        return next(c for c in self.controls if c.parameter == parameter and not c.derived)

    def parameters(self, setting: Mapping[str, float]) -> dict[str, float]:
        """Parameters of the problem at a setting: its defaults where no control tells."""
        found = dict(self.problem.parameters)
        for control in self.controls:
            if control.name in setting:
                found[control.parameter] = control.raw(setting[control.name], found)
        return found

    def value(self, control: str, solution: Solution) -> float:
        """The value of a control at a solution, in the user's unit."""
        return self.control(control).value(parameters_of(solution))

    def with_value(self, control: str, solution: Solution, value: float) -> Solution:
        """The unknowns of a solution with another value of a control: a guess."""
        found = self.control(control)
        return solution.with_parameters(**{found.parameter: found.raw(value, parameters_of(solution))})

    def free_with(self, *controls: str) -> tuple[str, ...]:
        """Free parameters of a branch or locus along which some controls vary."""
        return (*(self.control(name).parameter for name in controls), *self.free)

    # -- members of a state -------------------------------------------------------------------------------------------

    def sign_of(self, solution: Solution) -> str:
        """'+' or '-' of a member of a pair."""
        from rodatlas.model.orbit import sign_by_unknowns

        return self.sign(solution) if self.sign is not None else sign_by_unknowns(self, solution)

    def member(self, solution: Solution, sign: str) -> Solution:
        """The member of a pair with a sign: the solution, or an image of it; a state that stands alone is itself."""
        from rodatlas.model.orbit import is_alone, members

        if is_alone(self, solution) or self.sign_of(solution) == sign:
            return solution
        return next((m for m in members(self, solution) if self.sign_of(m) == sign), solution)

    def measures(self, solutions: Sequence[Solution]) -> tuple[list[float], list[float]]:
        """By what states of one name are numbered, and by what those for which that is equal."""
        first, *more = self.order or (self.quantities[0].name,)
        read = self.quantity(first).read if not self.order else (lambda s: float(s[first]))
        return [read(s) for s in solutions], [float(s[more[0]]) if more else 0.0 for s in solutions]

    def look(self, solution: Solution) -> str:
        """What tells a state from others, in words."""
        names = [x.name for x in self.invariants] or [q.observable for q in self.quantities if q.observable]
        return ", ".join(f"{name} {solution[name]:.6g}" for name in names)

    # -- as records ---------------------------------------------------------------------------------------------------

    def setting_json(self, setting: Mapping[str, float]) -> dict[str, float]:
        """Values of the controls at a setting by name, underscores for dashes; derived ones where they tell more."""
        held = {c.name: setting[c.name] for c in self.controls if c.name in setting}
        for control in (c for c in self.controls if c.derived):
            own = self.holder(control.name).name
            added = [c.name for c in self.controls if c.parameter in control.added and not c.derived]
            if held.get(own, 0.0) != 0.0 and all(name in held for name in added):
                held[control.name] = held[own] + sum(held[name] for name in added)
        return {name.replace("-", "_"): value for name, value in held.items()}

    def head_json(self, setting: Mapping[str, float], along: str, against: str) -> dict[str, Any]:
        """What stands first in the JSON of a result: model, setting and view, and the setting once more by the names
        that tables have."""
        flat = {c.key: setting[c.name] for c in self.controls if c.name in setting}
        head = {"model": self.name, "setting": self.setting_json(setting), "along": along, "against": against}
        return head | flat

    def reading_json(self, solution: Solution) -> dict[str, Any]:
        """All quantities of a state, as plain values; the loads of a rod as vectors in space at s = 0."""
        found: dict[str, Any] = {q.name: q.read(solution) for q in self.quantities if q.observable}
        if self.ribbon is not None:
            rod = self.ribbon(solution)
            found |= {"force": rod.force[0].tolist(), "moment": rod.moment[0].tolist()}
        return found

    # -- in words -----------------------------------------------------------------------------------------------------

    def setting_text(self, setting: Mapping[str, float]) -> str:
        """Values of the controls at a setting, those left out that are zero by default and here: 'angle 15 deg'."""
        told = [
            c for c in reversed(self.controls) if c.name in setting and (setting[c.name] != 0.0 or c.default != 0.0)
        ]
        return ", ".join(f"{c.name} {setting[c.name]:g}{f' {c.unit}' if c.unit else ''}" for c in told)

    def stem_parts(self, setting: Mapping[str, float]) -> list[str]:
        """Parts of names of files that tell a setting from others: '15', 'dL0.4'."""
        held = [c for c in reversed(self.controls) if c.name in setting]
        first = [exact(setting[c.name]) for c in held if c.short == ""]
        other = [
            f"{c.in_files}{exact(setting[c.name])}" for c in held if c.short != "" and setting[c.name] != c.default
        ]
        return [*([] if self.name == DEFAULT else [self.name]), *first, *other]


def parameters_of(solution: Solution) -> dict[str, float]:
    """Parameters of a solution by name."""
    return dict(zip(solution.parameter_names, solution.parameters.tolist(), strict=True))
