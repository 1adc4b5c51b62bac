"""Gauss-Legendre collocation on one interval: nodes, weights and differentiation of the interpolant."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

MOST_POINTS = 9


@dataclass(frozen=True)
class GaussScheme:
    """The polynomial of degree m through the left mesh point and the m Gauss points of [0, 1].

    Attributes
    ----------
    nodes, weights : (m,) Gauss-Legendre nodes and weights on [0, 1].
    d : (m, m), d0 : (m,) derivative at node i = d0[i] u_left + d[i] . U.
    d_inv : (m, m) inverse of d.
    c_left : float, c_stage : (m,) value at the right end = c_left u_left + c_stage . U.
    d_sign, d_log : sign and log|det| of d, taken out of determinants.
    top : (m+1,) coefficients of (u_left, U) in the m-th derivative of the interpolant.
    """

    points: int
    nodes: np.ndarray
    weights: np.ndarray
    d: np.ndarray
    d0: np.ndarray
    d_inv: np.ndarray
    c_left: float
    c_stage: np.ndarray
    d_sign: float
    d_log: float
    top: np.ndarray

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Lagrange basis (len(x), m+1) of the nodes (0, Gauss points) at x in [0, 1]."""
        return lagrange_basis(np.concatenate([[0.0], self.nodes]), np.asarray(x, dtype=float))


def lagrange_basis(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Values (len(x), len(nodes)) of the Lagrange polynomials."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    factors = np.repeat((x[:, None] - nodes)[:, None, :], len(nodes), axis=1)
    factors[:, range(len(nodes)), range(len(nodes))] = 1.0
    return np.asarray(np.prod(factors / apart, axis=2))


@lru_cache(maxsize=16)
def gauss_scheme(points: int) -> GaussScheme:
    """The scheme with `points` Gauss points (1 to 9); its order at mesh points is twice that."""
    if not 1 <= points <= MOST_POINTS:
        raise ValueError(f"collocation points: expected 1 to {MOST_POINTS}, got {points}")
    x, w = np.polynomial.legendre.leggauss(points)
    nodes, weights = (x + 1) / 2, w / 2
    all_nodes = np.concatenate([[0.0], nodes])
    # derivative matrix from barycentric weights: exact for the interpolant, better than differencing the basis
    bary = np.array([1 / np.prod(np.delete(node - all_nodes, i)) for i, node in enumerate(all_nodes)])
    diff = np.empty((points + 1, points + 1))
    for i in range(points + 1):
        for k in range(points + 1):
            if i != k:
                diff[i, k] = bary[k] / bary[i] / (all_nodes[i] - all_nodes[k])
        diff[i, i] = -(diff[i, :i].sum() + diff[i, i + 1 :].sum())
    end = lagrange_basis(all_nodes, np.array([1.0]))[0]
    d = np.ascontiguousarray(diff[1:, 1:])
    sign, log_det = np.linalg.slogdet(d)
    top = bary * float(np.prod(np.arange(1, points + 1)))
    return GaussScheme(
        points, nodes, weights, d, diff[1:, 0].copy(), np.linalg.inv(d), float(end[0]), end[1:].copy(),
        float(sign), float(log_det), top,
    )  # fmt: skip
