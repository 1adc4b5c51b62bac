"""A solution read as a rod: fields, energies, first integrals and counts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.rods.kinematics import directors
from rodatlas.rods.perfectly_anisotropic import check_rod
from rodatlas.rods.symmetry import asymmetry, is_symmetric


@dataclass(frozen=True)
class RodState:
    """View of a solution of :func:`rodatlas.rods.perfectly_anisotropic.rod_problem` as a rod.

    Fields are given at the mesh points `s` (K,), forces in GJ/L^2, moments in GJ/L, strains in 1/L.
    """

    solution: Solution

    def __post_init__(self) -> None:
        check_rod(self.solution)

    def __repr__(self) -> str:
        sol = self.solution
        return (
            f"RodState(angle {np.degrees(sol['psi0']):.6g} deg, dL {sol['dL']:.6g}, dD {sol['dD']:.6g}: "
            f"height {self.height:.6g}, energy {self.energy:.6g}, {'' if self.symmetric else 'not '}symmetric)"
        )

    @property
    def s(self) -> np.ndarray:
        """(K,) mesh points, from 0 to 1."""
        return self.solution.mesh

    def _columns(self, *names: str) -> np.ndarray:
        return np.column_stack([self.solution[name] for name in names])

    @cached_property
    def force(self) -> np.ndarray:
        """Body components (N1, N2, N3), (K, 3)."""
        return self._columns("N1", "N2", "N3")

    @cached_property
    def moment(self) -> np.ndarray:
        """Body components (M1, M2, M3) = (a k1, M2, tau), (K, 3)."""
        return self._columns("k1", "M2", "tau") * [self.solution["a"], 1.0, 1.0]

    @cached_property
    def strain(self) -> np.ndarray:
        """(k1, k2 = 0, tau), (K, 3)."""
        return np.insert(self._columns("k1", "tau"), 1, 0.0, axis=1)

    @cached_property
    def quaternion(self) -> np.ndarray:
        """(q0, q1, q2, q3), (K, 4)."""
        return self._columns("q0", "q1", "q2", "q3")

    @cached_property
    def position(self) -> np.ndarray:
        """Centerline (x, y, z), (K, 3)."""
        return self._columns("x", "y", "z")

    def in_space(self, body: np.ndarray) -> np.ndarray:
        """Space components (K, 3) of a field of body components."""
        return np.einsum("dka,kd->ka", np.array(directors(self.quaternion)), body)

    @property
    def height(self) -> float:
        """int y ds."""
        return float(self.solution.observables["height"])

    @property
    def energy(self) -> float:
        """int (a k1^2 + tau^2)/2 ds [GJ/L]."""
        return float(self.solution.observables["energy"])

    @cached_property
    def energy_parts(self) -> tuple[float, float]:
        """Bending and twisting energy, int a k1^2/2 ds and int tau^2/2 ds [GJ/L]."""
        sol = self.solution
        k1, tau = (sol.stages[..., sol.unknowns.index(name)] for name in ("k1", "tau"))
        return sol.mean(sol["a"] * k1**2 / 2), sol.mean(tau**2 / 2)

    @cached_property
    def first_integrals(self) -> dict[str, np.ndarray]:
        """N.N, N.M and H + N3 at the mesh points, (K,) each: constant without body force."""
        density = np.einsum("ka,ka->k", self.moment, self.strain) / 2
        return {
            "N.N": np.einsum("ka,ka->k", self.force, self.force),
            "N.M": np.einsum("ka,ka->k", self.force, self.moment),
            "H+N3": density + self.force[:, 2],
        }

    @cached_property
    def inflections(self) -> dict[str, int]:
        """Number of sign changes of k1 and of tau inside the rod; a strain below 1e-6 of the largest counts as zero."""
        s = np.linspace(0.0, 1.0, 801)[1:-1]
        strains = {name: self.solution(s, name) for name in ("k1", "tau")}
        floor = 1e-6 * max(np.abs(v).max() for v in strains.values())
        return {name: count_sign_changes(v, floor) for name, v in strains.items()}

    @property
    def symmetric(self) -> bool:
        """Whether the state equals its reversal."""
        return is_symmetric(self.solution)

    @property
    def asymmetry(self) -> float:
        """Distance from the reversal; see :func:`rodatlas.rods.symmetry.asymmetry`."""
        return asymmetry(self.solution)


def count_sign_changes(values: np.ndarray, floor: float) -> int:
    """Sign changes of samples, those of size below the floor skipped."""
    kept = values[np.abs(values) > floor]
    return int(np.sum(np.sign(kept[1:]) != np.sign(kept[:-1])))
