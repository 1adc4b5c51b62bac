"""How a user calls one state: a name, the member of a pair, and a number where several states share the name.

Two different stable states can have one name at one setting: at dL = 0.95 the branch of W holds two mirror images of
each other (dD -> -dD) that coexist around dD = 0. There they are called 'W:1' and 'W:2', in order of energy; states of
equal energy in order of its slope with the shear, dE/d(dD), so that the order at dD = 0 is that at small positive dD.
Where a name is unique it is the whole label.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import WrongInput
from rodatlas.model.registry import model_named

SAME_ENERGY = 1e-7  # relative difference below which two energies are one up to the tolerance of solutions
SEPARATOR = ":"
NUMBER = re.compile(r"[0-9]{1,6}")
T = TypeVar("T")


class Wanted(NamedTuple):
    """What a label says: a name of a nomenclature, '+', '-' or '' of a pair, and a number or None."""

    name: str
    sign: str
    number: int | None = None

    @property
    def member(self) -> str:
        """The name with the member: 'S+' of ('S+-', '+')."""
        return self.name.removesuffix("+-") + self.sign

    @property
    def label(self) -> str:
        """What the user wrote: the member, and the number if there is one."""
        return self.member if self.number is None else f"{self.member}{SEPARATOR}{self.number}"


def parse_label(text: str, names: Sequence[str] | None = None) -> Wanted:
    """('S+-', '+', None) from 'S+', 'S' or 'S+-'; ('W', '', 2) from 'W:2'.

    Parameters
    ----------
    names : that there are; those of the band by default.

    Raises
    ------
    ValueError
        when there is no such name.
    """
    called, separator, number = text.partition(SEPARATOR)
    bare, sign = re.fullmatch(r"(.*?)([+-]*)", called, re.DOTALL).groups()  # type: ignore[union-attr]
    numbered = not separator or (NUMBER.fullmatch(number) is not None and int(number) > 0)
    for name in names_of_band() if names is None else names:
        pair = name.endswith("+-")
        if numbered and bare == name.removesuffix("+-") and sign in (("", "+", "-", "+-") if pair else ("",)):
            return Wanted(name, ("-" if sign == "-" else "+") if pair else "", int(number) if separator else None)
    raise WrongInput("state", f"expected one of {known_names(names)}, got '{text}'")


def names_of_band() -> tuple[str, ...]:
    """The names that the nomenclature of the band has."""
    known = model_named("band").nomenclature
    return () if known is None else known.names


def known_names(names: Sequence[str] | None = None) -> str:
    """All names that a user can give, for messages; those of the band by default."""
    told = names_of_band() if names is None else names
    return ", ".join(n.replace("+-", "+, ") + n[:-2] + "-" if n.endswith("+-") else n for n in told)


def slope(solution: Solution) -> float:
    """dE/d(dD) = N_z of an equilibrium [GJ/L^2], by the force at s = 0."""
    return float(solution["end_force_z"])


def in_order(energies: Sequence[float], slopes: Sequence[float]) -> list[int]:
    """Positions of states in order of energy, those of equal energy in order of its slope with the shear."""
    order = sorted(range(len(energies)), key=lambda i: energies[i])
    groups: list[list[int]] = []
    for i in order:
        same = groups and energies[i] - energies[groups[-1][0]] < SAME_ENERGY * max(1.0, abs(energies[i]))
        if same:
            groups[-1].append(i)
        else:
            groups.append([i])
    return [i for group in groups for i in sorted(group, key=lambda i: slopes[i])]


def labels(names: Sequence[str | None], energies: Sequence[float], slopes: Sequence[float]) -> list[str | None]:
    """The label of each of some states at one setting: its name, with a number where others have the same one."""
    found = list(names)
    for name in {n for n in names if n is not None and names.count(n) > 1}:
        at = [i for i, n in enumerate(names) if n == name]
        for number, k in enumerate(in_order([energies[i] for i in at], [slopes[i] for i in at]), 1):
            found[at[k]] = f"{name}{SEPARATOR}{number}"
    return found


def chosen(wanted: Wanted, found: Sequence[tuple[T, str]]) -> T | None:
    """The one of several states of a name that a label means; None when there is no state of the name.

    Parameters
    ----------
    found : the states of that name in the order of their numbers, each with what tells it from the others, in words.

    Raises
    ------
    ValueError
        when there are several and the label has no number, or a number that none has.
    """
    if not found:
        return None
    if len(found) == 1 and wanted.number in (None, 1):
        return found[0][0]
    if wanted.number is not None and wanted.number <= len(found):
        return found[wanted.number - 1][0]
    if len(found) == 1:
        raise WrongInput("state", f"expected {wanted.member} without a number, there is one, got '{wanted.label}'")
    known = ", ".join(f"{wanted.member}{SEPARATOR}{i} ({text})" for i, (_, text) in enumerate(found, 1))
    raise WrongInput("state", f"expected one of {known}, got '{wanted.label}'")


def look(solution: Solution) -> str:
    """What tells a state from others, in words."""
    return f"energy {solution['energy']:.6g}, height {solution['height']:.5g}, dE/d(dD) {slope(solution):.4g}"


def in_file_name(label: str) -> str:
    """A label as a part of a file name, in which some systems allow no colon."""
    return label.replace(SEPARATOR, "-")
