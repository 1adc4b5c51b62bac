"""Order of elimination inside a mesh interval, read off the sparsity of the Jacobian f_u."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class Sparsity:
    """Strongly connected components of the graph of f_u, in an order in which each depends on earlier ones only.

    For a matrix with nonzeros x the unknowns {0, 1}, {2} and {3} are eliminated in turn::

            0 1 2 3
        0 [ x x . . ]      component {0, 1}: one dense block
        1 [ x x . . ]
        2 [ x . . . ]      component {2}: no own coupling, so its block is the same on every interval
        3 [ . . x x ]      component {3}

    Attributes
    ----------
    rows, cols : (nnz,) row and column of every nonzero, in the order in which values are delivered.
    member_ptr, members : component c holds the unknowns members[member_ptr[c]:member_ptr[c+1]].
    coupled : (nc,) whether component c has nonzeros inside itself.
    own_ptr, own : (3, .) nonzero number, local row, local column of the nonzeros inside each component.
    up_ptr, up : (3, .) nonzero number, local row, column (unknown) of the nonzeros towards earlier components.
    reach_ptr, reach : unknowns on whose value at the left mesh point the component depends.
    """

    size: int
    rows: np.ndarray
    cols: np.ndarray
    member_ptr: np.ndarray
    members: np.ndarray
    coupled: np.ndarray
    own_ptr: np.ndarray
    own: np.ndarray
    up_ptr: np.ndarray
    up: np.ndarray
    reach_ptr: np.ndarray
    reach: np.ndarray

    @property
    def components(self) -> list[list[int]]:
        return [self.members[a:b].tolist() for a, b in zip(self.member_ptr[:-1], self.member_ptr[1:], strict=True)]

    @cached_property
    def row_sums(self) -> np.ndarray:
        """(nnz, n) matrix of ones that adds up the nonzeros of each row."""
        ones = np.zeros((len(self.rows), self.size))
        ones[np.arange(len(self.rows)), self.rows] = 1.0
        return ones

    @cached_property
    def counts(self) -> np.ndarray:
        """(nc,) unknowns of each component."""
        return np.diff(self.member_ptr)

    @cached_property
    def reaches(self) -> np.ndarray:
        """(nc,) unknowns at the left mesh point on which each component depends."""
        return np.diff(self.reach_ptr)

    @cached_property
    def largest(self) -> int:
        """Size of the largest component that depends on itself."""
        return int(self.counts[self.coupled].max(initial=0))

    @cached_property
    def independent(self) -> list[np.ndarray]:
        """Of each component, local numbers of unknowns that depend on none of one another, nor on themselves.

        They are gathered greedily, those with the fewest nonzeros in row and column first.
        """
        return [_independent(self.own[1:, a:b], int(size)) for a, b, size in
                zip(self.own_ptr[:-1], self.own_ptr[1:], self.counts, strict=True)]  # fmt: skip

    def __repr__(self) -> str:
        return f"Sparsity({len(self.rows)} nonzeros, components of sizes {[len(c) for c in self.components]})"


def strong_components(size: int, rows: np.ndarray, cols: np.ndarray) -> Sparsity:
    """Strongly connected components by Tarjan's algorithm (Tarjan 1972), upstream components first."""
    depends: list[list[int]] = [[] for _ in range(size)]
    for r, c in zip(rows.tolist(), cols.tolist(), strict=True):
        depends[r].append(c)
    components = _tarjan(depends)
    home = {u: i for i, members in enumerate(components) for u in members}
    local = {u: k for members in components for k, u in enumerate(members)}
    own: list[list[tuple[int, int, int]]] = [[] for _ in components]
    up: list[list[tuple[int, int, int]]] = [[] for _ in components]
    reach: list[set[int]] = [set(members) for members in components]
    for nz, (r, c) in enumerate(zip(rows.tolist(), cols.tolist(), strict=True)):
        if home[r] == home[c]:
            own[home[r]].append((nz, local[r], local[c]))
        else:
            up[home[r]].append((nz, local[r], c))
    for i in range(len(components)):
        for _, _, c in up[i]:
            reach[i] |= reach[home[c]]
    member_ptr, members = _pack([[(u,) for u in members] for members in components], 1)
    own_ptr, own_flat = _pack(own, 3)
    up_ptr, up_flat = _pack(up, 3)
    reach_ptr, reach_flat = _pack([[(u,) for u in sorted(r)] for r in reach], 1)
    coupled = np.array([len(o) > 0 for o in own])
    return Sparsity(
        size, rows, cols, member_ptr, members[0], coupled, own_ptr, own_flat, up_ptr, up_flat, reach_ptr, reach_flat[0]
    )


def _independent(own: np.ndarray, size: int) -> np.ndarray:
    """Local numbers of unknowns among which a component (row, column of its nonzeros) has none."""
    rows, cols = own
    near = [{*cols[rows == i].tolist(), *rows[cols == i].tolist()} for i in range(size)]
    busy = np.bincount(rows, minlength=size) + np.bincount(cols, minlength=size)
    chosen: set[int] = set()
    for i in np.argsort(busy, kind="stable").tolist():
        if i not in near[i] and not near[i] & chosen:
            chosen.add(i)
    return np.array(sorted(chosen), dtype=np.int64)


def _tarjan(depends: list[list[int]]) -> list[list[int]]:
    """Components in order of completion: everything that a component depends on comes before it."""
    index: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    result: list[list[int]] = []

    def visit(node: int) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in depends[node]:
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            cut = stack.index(node)
            result.append(sorted(stack[cut:]))
            del stack[cut:]

    for node in range(len(depends)):
        if node not in index:
            visit(node)
    return result


def _pack(groups: Sequence[Sequence[tuple[int, ...]]], width: int) -> tuple[np.ndarray, np.ndarray]:
    pointer = np.concatenate([[0], np.cumsum([len(g) for g in groups])]).astype(np.int64)
    flat = np.array([item for g in groups for item in g], dtype=np.int64).reshape(-1, width)
    return pointer, np.ascontiguousarray(flat.T)
