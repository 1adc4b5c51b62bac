"""Whether a band meets itself: the ribbon around a rod, tested for a common point of two of its parts.

Equilibria know nothing of contact. Where two parts of a band meet, the band of the equations passes through itself,
and a real one would push against itself there. The thickness is neglected: a real band meets itself a little earlier.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rodatlas.rods.band import NARROW, check_between
from rodatlas.rods.formulation import by_name, check_names
from rodatlas.rods.kinematics import POSE, pose_of, ribbon

if TYPE_CHECKING:
    from rodatlas.continuation import Solution

SECTIONS = 241  # the polyhedron of so many is within h^2 k1/8 = 2e-5 L of a ribbon with k1 = 10/L
TURN = 20.0  # radians by which a band turns that take as many cross-sections as its whole length if it is straight
LINES = np.array([-0.5, 0.0, 0.5])  # across the width: both edges; the center line is for planar bands, see _segments
SLACK = 1e-9  # of a segment and of a triangle, so that a point on a common side of two is on one of them
PARALLEL = 1e-12  # of the product of three lengths: below it a segment is parallel to a triangle


@dataclass(frozen=True)
class Contact:
    """A common point of two parts of a band.

    Attributes
    ----------
    s : arclengths of the two parts, the smaller first, in units of the rod length.
    width : of the band that was tested, w = D/L.
    """

    s: tuple[float, float]
    width: float

    def __repr__(self) -> str:
        return f"Contact(s = {self.s[0]:.4g} and {self.s[1]:.4g}, width {self.width:g})"


def self_contact(solution: Solution, width: float = NARROW, sections: int = SECTIONS) -> Contact | None:
    r"""Where the ribbon :math:`X(s) + u\,d_1(s)`, :math:`|u| \le w/2`, meets itself.

    The ribbon is replaced by triangles between cross-sections (:func:`sections_of`). Pairs of parts that are too far
    apart, or between which the band turns too little to come back (:func:`_may_meet`), are left out; of the others the
    sides and the center line of each are cut with the triangles of the other.

    Parameters
    ----------
    solution : of a rod problem, with unknowns q0..q3 and x, y, z.
    width : w, in units of the length.
    sections : number of cross-sections; the error of the surface falls as its square.

    Returns
    -------
    the common point of least arclength between its two parts; None when the band does not meet itself.

    Raises
    ------
    ValueError
        when the width is not between 0 and 10, or there are fewer than three sections.
    """
    check_names(solution, POSE)
    width = check_between("width", width, 0.0, 10.0, "the width over the length, between 0 and 10")
    if sections < 3:
        raise ValueError(f"sections: expected at least 3, got {sections}")
    s = sections_of(solution, sections)
    met = meeting(s, *ribbon(solution, s), width)
    return None if met is None else Contact(met, width)


def sections_of(solution: Solution, count: int) -> np.ndarray:
    """(count,) arclengths of cross-sections, denser where the band bends or twists more; the mesh tells where."""
    q, _ = pose_of(by_name(solution.unknowns, solution.values))
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    turns = 2.0 * np.arccos(np.minimum(np.abs(np.einsum("na,na->n", q[1:], q[:-1])), 1.0))
    weight = solution.mesh + np.concatenate([[0.0], np.cumsum(turns)]) / TURN
    return np.interp(np.linspace(0.0, weight[-1], count), weight, solution.mesh)


def meeting(s: np.ndarray, center: np.ndarray, frame: np.ndarray, width: float) -> tuple[float, float] | None:
    """The arclengths at which a ribbon meets itself, the smaller first; None where it does not.

    Parameters
    ----------
    s : (n,) cross-sections. center : (n, 3) center line. frame : (3, n, 3) directors. width : w.
    """
    one, two = _near(s, center, frame, width)
    if not len(one):
        return None  # hardly any state gets further
    lines = center + LINES[:, None, None] * width * frame[0]
    found = np.concatenate([_meetings(lines, one, two), _meetings(lines, two, one)])
    if not len(found):
        return None
    at = np.interp(np.sort(found, axis=1), np.arange(len(s)), s)
    first, second = at[np.argmin(at[:, 1] - at[:, 0])]
    return float(first), float(second)


def places_text(contact: Contact | None) -> str:
    """Arclengths in words: '0.0281 and 0.9719'; nothing without contact."""
    return f"{contact.s[0]:.4f} and {contact.s[1]:.4f}" if contact else ""


def width_text(width: float) -> str:
    """A width as a part of the length: 'L/80', '0.03 L'."""
    whole = round(1.0 / width)
    return f"L/{whole}" if math.isclose(whole * width, 1.0, rel_tol=1e-9) else f"{width:g} L"


def may_touch(s: np.ndarray, center: np.ndarray, frame: np.ndarray, width: float) -> bool:
    """Whether two parts of a ribbon are near enough to meet; parameters as in :func:`meeting`."""
    return bool(len(_near(s, center, frame, width)[0]))


def _near(s: np.ndarray, center: np.ndarray, frame: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of parts (i, j), i + 1 < j, that may meet; part i lies between the cross-sections i and i + 1."""
    middle = 0.5 * (center[1:] + center[:-1])
    size = np.einsum("ia,ia->i", middle, middle)
    square = size[:, None] + size - 2.0 * middle @ middle.T
    radius = 0.5 * (np.diff(s) + width)  # about its middle a part has no point further away
    one, two = np.nonzero(square <= (radius[:, None] + radius) ** 2)
    one, two = one[two > one + 1], two[two > one + 1]
    may = _may_meet(s, frame, one, two, width)
    return one[may], two[may]


def _may_meet(s: np.ndarray, frame: np.ndarray, one: np.ndarray, two: np.ndarray, width: float) -> np.ndarray:
    r"""Whether the band turns enough between two parts to come back.

    Let the frame turn by the angle :math:`\theta < \pi` from one ruling to another, at the arclength :math:`\delta`.
    In the direction of the tangent where half of it is reached, the center line advances by
    :math:`\delta\cos(\theta/2)` at least, and two points off it lose :math:`w\sin(\theta/2)` at most. They can only
    coincide if :math:`w\tan(\theta/2) \ge \delta`.
    """
    trace = np.einsum("dna,dna->n", frame[:, 1:], frame[:, :-1])
    turned = np.concatenate([[0.0], np.cumsum(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))])
    half = 0.5 * (turned[two + 1] - turned[one])
    return (half >= 0.5 * np.pi) | (width * np.sin(half) >= (s[two] - s[one + 1]) * np.cos(half))


def _meetings(lines: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Where segments on some parts of a band cut the triangles of others.

    Parameters
    ----------
    lines : (3, n, 3) the edge -w/2, the center line and the edge +w/2.
    one, two : (m,) parts whose segments and whose triangles are taken.

    Returns
    -------
    (k, 2) the places of the meetings on the two parts, in numbers of cross-sections.
    """
    start, way, advance = _segments(lines, one)
    corner, across = lines[0, two], lines[2, two + 1] - lines[0, two]
    found = []
    for last in (False, True):  # the two triangles on either side of the diagonal `across`
        side = lines[2, two] - corner if last else lines[0, two + 1] - corner
        t, u, v = _cut(start, way, corner, across, side)
        low, high = -SLACK, 1.0 + SLACK
        hit = (t >= low) & (t <= high) & (u >= low) & (v >= low) & (u + v <= high)
        segment, pair = np.nonzero(hit)
        from_start, along = advance[:, segment], u[hit] if last else u[hit] + v[hit]
        found.append(np.column_stack([one[pair] + from_start[0] + t[hit] * from_start[1], two[pair] + along]))
    return np.concatenate(found)


def _segments(lines: np.ndarray, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Segments on parts of a band that another part cannot miss when it cuts through: the three lines, and the rulings
    at both ends.

    Two parts intersect along a curve that ends on a side of one of them. In a planar band it is a ruling, whose ends
    lie on edges of both, a matter of round-off; the center line of each then cuts the other in its middle.

    Returns
    -------
    start, way : (5, m, 3), and the arclength at the start and along the way, (2, 5), in numbers of cross-sections.
    """
    here, there = lines[:, part], lines[:, part + 1]
    start = np.concatenate([here, here[:1], there[:1]])
    way = np.concatenate([there - here, (here[2] - here[0])[None], (there[2] - there[0])[None]])
    return start, way, np.array([[0.0, 0.0, 0.0, 0.0, 1.0], [1.0, 1.0, 1.0, 0.0, 0.0]])


def _cut(
    start: np.ndarray, way: np.ndarray, corner: np.ndarray, first: np.ndarray, second: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solve start + t way = corner + u first + v second by Cramer's rule; NaN where the segment is parallel."""
    normal, offset = np.cross(first, second), start - corner
    det = -np.einsum("lma,ma->lm", way, normal)
    sizes = [np.linalg.norm(x, axis=-1) for x in (way, first, second)]
    det = np.where(np.abs(det) > PARALLEL * sizes[0] * sizes[1] * sizes[2], det, np.nan)
    turned = np.cross(offset, way)
    t = np.einsum("lma,ma->lm", offset, normal) / det
    u = np.einsum("lma,ma->lm", turned, second) / det
    v = -np.einsum("lma,ma->lm", turned, first) / det
    return t, u, v
