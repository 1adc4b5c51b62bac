"""The fast backend: stages (kernels in `_stages.py`), then mesh points (`_elimination.py`), eliminated in Numba."""

from __future__ import annotations

import sys
import threading
from functools import lru_cache
from types import ModuleType

import numpy as np

from rodatlas.continuation.linear.matrix import Blocks, BorderedMatrix, Columns
from rodatlas.continuation.linear.sparsity import Sparsity


@lru_cache(maxsize=1)
def kernels() -> tuple[ModuleType, ModuleType]:
    """The kernels of stages and of mesh points, imported when they are needed."""
    from rodatlas.continuation.linear import _elimination, _stages

    return _stages, _elimination


class FirstCompile:
    """Context that prints one line on stderr when a kernel is being compiled in it, rather than loaded from the cache,
    and that takes longer than `patience` seconds."""

    def __init__(self, patience: float = 1.5):
        self._timer = threading.Timer(patience, self._say)
        self._timer.daemon = True

    @staticmethod
    def _say() -> None:
        counts = [f.stats.cache_misses for part in kernels() for f in vars(part).values() if hasattr(f, "stats")]
        if not any(any(misses.values()) for misses in counts):
            return  # the machine is busy, no more
        print("compiling the solver (once per installation, about 15 s) ...", file=sys.stderr, flush=True)

    def __enter__(self) -> None:
        self._timer.start()

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()


@lru_cache(maxsize=64)
def _layout(rows: tuple[int, ...], widths: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Offsets of the eliminated rows and the pivots of each component in the stores of a group of intervals."""
    lu_ptr = np.concatenate([[0], np.cumsum(np.multiply(rows, widths))]).astype(np.int64)
    piv_ptr = np.concatenate([[0], np.cumsum(rows)]).astype(np.int64)
    return lu_ptr, piv_ptr


def _structure(sp: Sparsity) -> tuple[np.ndarray, ...]:
    return sp.member_ptr, sp.members, sp.coupled, sp.up_ptr, sp.up


_warm = threading.Event()
_plain = np.ascontiguousarray  # the kernels are compiled for arrays that are


class NumbaFactorization:
    """Factors of one matrix; see :class:`rodatlas.continuation.linear.matrix.Factorization`."""

    def __init__(self, matrix: BorderedMatrix):
        if _warm.is_set():
            self._factor(matrix)
            return
        with FirstCompile():
            self._factor(matrix)
            n_int, m, n, k = matrix.sizes
            if self.sign != 0.0:
                q, r = matrix.b_left.shape[0], matrix.dense.shape[0]
                self.solve(Blocks(np.ones((n_int, m, n)), np.zeros((n_int, n)), np.zeros(q), np.zeros(r)))
                self.solve_transposed(Columns(np.zeros((n_int, m, n)), np.zeros((n_int + 1, n)), np.zeros(k)))
                _warm.set()

    def _factor(self, matrix: BorderedMatrix) -> None:
        stages, kern = kernels()
        n_int, m, n, k = matrix.sizes
        sp, scheme = matrix.sparsity, matrix.scheme
        r = matrix.dense.shape[0]
        rows = m * sp.counts
        widths = np.where(sp.coupled, rows, 0) + sp.reaches + k
        self._lu_ptr, self._piv_ptr = _layout(tuple(rows.tolist()), tuple(widths.tolist()))
        groups, lanes = -(-n_int // stages.LANES), stages.LANES
        self._lu = np.empty((groups, int(self._lu_ptr[-1]), lanes))
        self._piv = np.empty((groups, int(self._piv_ptr[-1]), lanes), dtype=np.int64)
        self._feed = np.empty((groups, m * sp.up.shape[1], lanes))
        self._sens = np.empty((n_int, m * n, n + k))
        self._matrix = matrix
        sign_stage, log_stage = stages.factor_stages(
            matrix.jac, matrix.step, matrix.stage_scal, scheme.d, scheme.d0, scheme.d_inv, sp.member_ptr, sp.members,
            sp.coupled, sp.own_ptr, sp.own, sp.up_ptr, sp.up, sp.reach_ptr, sp.reach, self._lu_ptr, self._lu,
            self._piv_ptr, self._piv, self._feed, self._sens,
        )  # fmt: skip
        self._merged = np.empty((n_int - 1, 2 * n + r, 3 * n + k))
        self._merge_piv = np.empty((n_int - 1, n), dtype=np.int64)
        self._final = np.empty((2 * n + k, 2 * n + k))
        self._final_piv = np.empty(2 * n + k, dtype=np.int64)
        transfer = np.empty((n_int, n, n + k))
        rows_u, rows_s = np.empty((n_int + 1, r, n)), np.empty((r, k))
        kern.condense(
            self._sens, scheme.c_left, scheme.c_stage, matrix.dense, matrix.dense_scal, transfer, rows_u, rows_s
        )
        sign, log_det = kern.factor_mesh(
            transfer, matrix.b_left, matrix.b_right, matrix.b_scal, rows_u, rows_s,
            self._merged, self._merge_piv, self._final, self._final_piv,
        )  # fmt: skip
        coupled = n_int * int(sp.counts[sp.coupled].sum())
        self.sign = float(sign_stage * sign * (scheme.d_sign**coupled))
        self.log_det = float(log_stage + log_det - coupled * scheme.d_log)
        if not np.isfinite(self.log_det):
            self.sign, self.log_det = 0.0, -np.inf

    def solve(self, rhs: Blocks) -> Columns:
        (stages, kern), a = kernels(), self._matrix
        n_int, m, n, k = a.sizes
        stage = rhs.stage.reshape(n_int, m * n).copy()
        if stage.any():  # kernel vectors have no residual
            stages.solve_stages(
                stage, a.scheme.d_inv, *_structure(a.sparsity), self._lu_ptr, self._lu, self._piv_ptr, self._piv,
                self._feed,
            )  # fmt: skip
        mesh, scalars = np.empty((n_int + 1, n)), np.empty(k)
        kern.solve_mesh(stage, *map(_plain, (rhs.chain, rhs.ends, rhs.dense)), *self._mesh_level(), mesh, scalars)
        return Columns(stage.reshape(n_int, m, n), mesh, scalars)

    def solve_transposed(self, rhs: Columns) -> Blocks:
        (stages, kern), a = kernels(), self._matrix
        n_int, m, n, _ = a.sizes
        stage = rhs.stage.reshape(n_int, m * n).copy()
        chain, ends, dense = np.empty((n_int, n)), np.empty(len(a.b_left)), np.empty(len(a.dense))
        loads = map(_plain, (rhs.mesh, rhs.scalars))
        kern.solve_mesh_transposed(stage, *loads, *self._mesh_level(), chain, ends, dense)
        stages.solve_stages_transposed(
            stage, a.scheme.d_inv, *_structure(a.sparsity), self._lu_ptr, self._lu, self._piv_ptr, self._piv, self._feed
        )
        return Blocks(stage.reshape(n_int, m, n), chain, ends, dense)

    def _mesh_level(self) -> tuple[np.ndarray, ...]:
        a = self._matrix
        weights = a.dense.reshape(len(a.dense), a.sizes[0], a.sizes[1] * a.sizes[2])
        return (
            a.scheme.c_stage, weights, self._sens, self._merged, self._merge_piv, self._final, self._final_piv,
        )  # fmt: skip
