"""The matrix of a problem bordered with rows and artificial columns, what its solves tell, and its left vectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rodatlas.continuation.discrete.collocation import Collocation, Linearization, Row
from rodatlas.continuation.discrete.vectors import scaled
from rodatlas.continuation.linear.matrix import Blocks, Columns, Factorization
from rodatlas.continuation.singular.smallest import smallest_singular

UPRIGHT = 1e-6  # kernel vectors at a branch point whose lambda components are below this are told apart by continuity


@dataclass(frozen=True)
class Border:
    """Kernel vectors (one at a fold, two at a branch point) that make the rows, and the artificial column."""

    vectors: tuple[Columns, ...]
    column: Blocks


@dataclass(frozen=True)
class Tests:
    """What is watched along a locus.

    values : test functions by name; determinant : sign and log|det| of the bordered matrix, whose zero means one more
    vector in the kernel; weakness : its smallest singular value with that sign; weakest : the right vector to it;
    shares : on a locus of folds, psi.F_lambda and psi.F_mu (up to a factor).
    """

    values: dict[str, float] = field(default_factory=dict)
    determinant: tuple[float, float] = (1.0, 0.0)
    shares: tuple[float, float] = (1.0, 1.0)
    weakness: float = 1.0
    weakest: Columns | None = field(default=None, repr=False)


class BorderedSystem:
    r"""The factored matrix of F' with the columns of some free parameters, rows C and artificial columns B,

    .. math:: K = \begin{pmatrix} F' & B \\ C & 0 \end{pmatrix}.

    Parameters
    ----------
    lin : F' at a state; rows : C; columns : B (d of them).
    scalars : numbers of the free parameters whose columns F' has; all of them by default.
    """

    def __init__(
        self, colloc: Collocation, lin: Linearization, rows: Sequence[Row], columns: Sequence[Blocks] = (),
        scalars: Sequence[int] | None = None,
    ):  # fmt: skip
        self.colloc, self.rows, self.columns = colloc, list(rows), tuple(columns)
        self.scalars = np.arange(len(colloc.free)) if scalars is None else np.array(scalars, dtype=np.int64)
        if scalars is not None:
            self.rows = [Row(r.scalars[self.scalars], r.stage, r.ends) for r in rows]
            lin = lin.with_scalars(scalars)
        self.fac: Factorization = colloc.factor(lin, self.rows, self.columns)

    @property
    def is_singular(self) -> bool:
        return self.fac.sign == 0.0

    def solved(
        self, residual: Blocks | None, values: Sequence[float], held: Mapping[int, float] | None = None
    ) -> tuple[Columns, np.ndarray]:
        """The vector v and the shares g (d,) with F'v + B g = -residual (None: zero) and C v = values.

        held : values of free parameters, by number, that the matrix has no columns of.
        """
        y = self.fac.solve(self.colloc.right_hand_side(residual, self.rows, values))
        count, scalars = len(self.scalars), np.zeros(len(self.colloc.free))
        scalars[self.scalars] = y.scalars[:count]
        for index, value in (held or {}).items():
            scalars[index] = value
        return Columns(y.stage, y.mesh, scalars), y.scalars[count:]

    def kernel(self) -> tuple[list[Columns], np.ndarray]:
        """V and G (d, rows) with F'V + B G = 0, C V = I: where F' loses rank, G does too."""
        found = [self.solved(None, values) for values in np.eye(len(self.rows)).tolist()]
        return [v for v, _ in found], np.array([g for _, g in found]).T

    def left_vector(self, scalar: int) -> Blocks:
        """w with w K = unit vector of one scalar unknown; artificial ones are counted after the free parameters."""
        x = np.eye(len(self.scalars) + len(self.columns))[scalar]
        shape = (*self.colloc.gauss.shape, len(self.colloc.scale.unknowns))
        return self.fac.solve_transposed(Columns(np.zeros(shape), np.zeros((len(self.colloc.mesh), shape[2])), x))

    def left_vectors(self) -> list[Blocks]:
        """Left vectors of all artificial unknowns."""
        return [self.left_vector(len(self.scalars) + i) for i in range(len(self.columns))]


class Bordered(BorderedSystem):
    """The same with rows from kernel vectors and one artificial column."""

    def __init__(self, colloc: Collocation, lin: Linearization, border: Border, scalars: list[int]):
        super().__init__(colloc, lin, [colloc.row(v) for v in border.vectors], [border.column], scalars)

    def solve(self, residual: Blocks | None, values: list[float], mu: dict[int, float]) -> tuple[Columns, float]:
        """Minus the residual (None: zero) and values on the rows -> vector with the other scalars set, share of b."""
        v, share = self.solved(residual, values, mu)
        return v, float(share[0])

    def tests(self, values: dict[str, float], near: Columns | None, shares: tuple[float, float] = (1.0, 1.0)) -> Tests:
        """Test functions, with those of the matrix itself added."""
        weakest, value = smallest_singular(self.colloc, self.fac, near, len(self.scalars) + 1)
        return Tests(values, (self.fac.sign, self.fac.log_det), shares, self.fac.sign * value, weakest)

    def left(self) -> Blocks:
        """The left kernel vector, where the matrix without borders is singular."""
        return self.left_vector(-1)


def overlap(w: Blocks, r: Blocks) -> float:
    """Sum of the products of a left vector and a residual, over the problem's own rows."""
    ends, dense = w.ends[: len(r.ends)], w.dense[: len(r.dense)]
    return float(np.vdot(w.stage, r.stage) + np.vdot(w.chain, r.chain) + ends @ r.ends + dense @ r.dense)


def norm_of(w: Blocks) -> float:
    """Euclidean length of a left vector."""
    return float(np.sqrt(overlap(w, w)))


def unit(w: Blocks) -> Blocks:
    """A left vector of Euclidean length one."""
    size = norm_of(w)
    return Blocks(w.stage / size, w.chain / size, w.ends / size, w.dense / size)


def left_column(colloc: Collocation, psi: Blocks) -> Blocks:
    """Artificial column from a left vector of a bordered matrix: the share of the problem's own equations."""
    psi = unit(psi)
    n_boundary, n_integral = colloc.bvp.n_boundary, colloc.bvp.n_integral
    return Blocks(psi.stage, np.zeros_like(psi.chain), psi.ends[:n_boundary], psi.dense[:n_integral])


def combined_left(vectors: Sequence[Blocks], factors: np.ndarray) -> Blocks:
    """Sum of factor * left vector."""
    parts = [[getattr(v, name) * f for v, f in zip(vectors, factors, strict=True)] for name in
             ("stage", "chain", "ends", "dense")]  # fmt: skip
    return Blocks(*(np.sum(part, axis=0) for part in parts))


def loaded(residual: Blocks, beta: Sequence[float] | np.ndarray, columns: Sequence[Blocks]) -> Blocks:
    """F + B beta."""
    load = combined_left(columns, np.asarray(beta))
    return Blocks(
        residual.stage + load.stage, residual.chain, residual.ends + load.ends, residual.dense + load.dense
    )  # fmt: skip


def unit_vector(colloc: Collocation, v: Columns) -> Columns:
    """A tangent, kept in the symmetric subspace if there is one, as a unit vector."""
    v = colloc.kept_symmetric(v)
    return scaled(v, 1.0 / colloc.norm(v))
