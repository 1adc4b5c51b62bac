"""A solution read as a rod: fields by name, energies, first integrals and counts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rodatlas.continuation import Solution
from rodatlas.continuation.checks import as_array, check_type
from rodatlas.rods.elastic import ANISOTROPIC
from rodatlas.rods.formulation import Formulation, Sections, components, parameters_of
from rodatlas.rods.kinematics import directors
from rodatlas.rods.law import Law
from rodatlas.rods.loaded import formulation_of
from rodatlas.rods.perfectly_anisotropic import FULL, REDUCED
from rodatlas.rods.poses import Clamps
from rodatlas.rods.sections import CIRCLE_SECTION, ELLIPSE, RECTANGLE
from rodatlas.rods.unknowns import CLAMPS

FORMULATIONS = (  # those that a solution without further notice may be of, those that need more names first
    FULL, REDUCED, *(formulation_of(section) for section in (RECTANGLE, ELLIPSE, CIRCLE_SECTION, None)), ANISOTROPIC,
)  # fmt: skip
SYMMETRIC = 1e-5  # largest asymmetry of a state that equals its reversal


@dataclass(frozen=True, eq=False)
class RodState:
    """A solution of a rod problem by names: the one way to read its fields.

    Fields are arrays over the places `s`: the mesh points, or those of :meth:`at` and :meth:`at_gauss_points`. Lengths
    are in units of the rod's length L, forces in GJ/L^2, moments in GJ/L, strains in 1/L. A field without `body` in its
    name has components in space if it is a force, moment, position or director; strains are components along the
    directors.

    Attributes
    ----------
    solution : of :func:`rodatlas.rods.rod_problem`, :func:`rodatlas.rods.reduced_problem` or
        :func:`rodatlas.rods.anisotropic_rod`, or of the problem of `formulation`.
    formulation : what its unknowns mean; None: told by their names.

    Raises
    ------
    ValueError
        for what is no such solution.

    Examples
    --------
    >>> state = RodState(state_at(Ends(45.0, shear=0.2)))
    >>> state.force.shape == (len(state.s), 3)
    True
    >>> middle = state.at(0.5)
    >>> float(middle.k1[0]), float(middle.energy_density[0])
    """

    solution: Solution
    formulation: Formulation | None = None
    _samples: tuple[np.ndarray, np.ndarray] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.formulation is not None:
            check_type("formulation", self.formulation, Formulation, "that of an elastic_rod, or None")
        self._reader.check(self.solution)

    def __repr__(self) -> str:
        known = parameters_of(self.solution)
        setting = [f"angle {np.degrees(known['psi0']):.6g} deg"] if "psi0" in known else []
        setting += [f"{name} {known[name]:.6g}" for name in ("dL", "dD") if name in known]
        setting += [f"{name} {known[name]:.6g}" for name in CLAMPS[3:] if known.get(name)]
        shape = f"height {self.height:.6g}, energy {self.energy:.6g}, {'' if self.symmetric else 'not '}symmetric"
        return f"RodState({', '.join(setting)}: {shape})"

    @cached_property
    def _reader(self) -> Formulation:
        """What the unknowns mean."""
        if self.formulation is not None:
            return self.formulation
        known = FORMULATIONS if isinstance(self.solution, Solution) else ()
        return next((x for x in known if not x.missing(self.solution)), FULL)

    def at(self, s: np.ndarray | float) -> RodState:
        """The same state at any places s (n,) from 0 to 1, interpolated."""
        s = np.atleast_1d(as_array("s", s))
        return replace(self, _samples=(s, self.solution(s)))

    def at_gauss_points(self) -> RodState:
        """The same state at the Gauss points (N, m) of its mesh, where :meth:`Solution.mean` wants densities."""
        return replace(self, _samples=(self.solution.gauss_points(), self.solution.stages))

    def rewritten(self, formulation: Formulation, **parameters: float) -> Solution:
        """The solution in other unknowns on the same mesh, a first guess for their problem.

        Parameters
        ----------
        formulation : of the other problem, such as `anisotropic_rod().formulation`.
        parameters : of those that this solution does not have, or that shall be others.

        Raises
        ------
        ValueError
            when a parameter of the other formulation is not known.
        """
        known = parameters_of(self.solution) | parameters
        if lacking := [name for name in formulation.parameters if name not in known]:
            raise ValueError(f"parameters: expected {', '.join(lacking)} too, which this solution lacks, got none")
        wanted = {name: known[name] for name in formulation.parameters}
        return self._reader.rewritten(self.solution, formulation, wanted)

    # -- fields -------------------------------------------------------------------------------------------------------

    @property
    def s(self) -> np.ndarray:
        """(...) places, from 0 to 1; (K,) mesh points unless other ones were asked for."""
        return self.solution.mesh if self._samples is None else self._samples[0]

    @cached_property
    def sections(self) -> Sections:
        """All that is read from the unknowns."""
        values = self.solution.values if self._samples is None else self._samples[1]
        return self._reader.sections(self.solution, values)

    @cached_property
    def law(self) -> Law:
        """The law of the rod, at the parameters of the solution."""
        return self._reader.law(parameters_of(self.solution))

    @property
    def clamps(self) -> Clamps:
        """The poses in which the ends are held, at the parameters of the solution."""
        return self._reader.clamps(parameters_of(self.solution))

    @property
    def force_body(self) -> np.ndarray:
        """(N1, N2, N3), (..., 3)."""
        return self.sections.force

    @property
    def moment_body(self) -> np.ndarray:
        """(M1, M2, M3), (..., 3)."""
        return self.sections.moment

    @property
    def strain(self) -> np.ndarray:
        """(k1, k2, tau), (..., 3)."""
        return self.sections.strain

    @property
    def k1(self) -> np.ndarray:
        """Curvature about the width d1, (...)."""
        return self.strain[..., 0]

    @property
    def k2(self) -> np.ndarray:
        """Curvature about the normal d2, (...)."""
        return self.strain[..., 1]

    @property
    def tau(self) -> np.ndarray:
        """Twist, (...)."""
        return self.strain[..., 2]

    @property
    def tension(self) -> np.ndarray:
        """N3, the force along the tangent, (...)."""
        return self.force_body[..., 2]

    @property
    def quaternion(self) -> np.ndarray:
        """(q0, q1, q2, q3), (..., 4)."""
        return self.sections.quaternion

    @property
    def position(self) -> np.ndarray:
        """Center line (x, y, z), (..., 3)."""
        return self.sections.position

    @cached_property
    def directors(self) -> np.ndarray:
        """(..., 3, 3): rows d1 (width), d2 (normal), d3 (tangent); orthonormal."""
        q = self.quaternion
        return np.stack(directors(q / np.linalg.norm(q, axis=-1, keepdims=True)), axis=-2)

    @cached_property
    def force(self) -> np.ndarray:
        """n = N1 d1 + N2 d2 + N3 d3 in space, (..., 3); constant without load."""
        return self.in_space(self.force_body)

    @cached_property
    def moment(self) -> np.ndarray:
        """m = M1 d1 + M2 d2 + M3 d3 in space, (..., 3)."""
        return self.in_space(self.moment_body)

    @cached_property
    def compliance(self) -> np.ndarray:
        """Derivative of the strain by the body moment, (..., 3, 3) [1/GJ]; see :class:`rodatlas.rods.law.Law`."""
        rows = self.law.compliance(components(self.moment_body))
        columns = np.broadcast_arrays(self.k1, *(entry for row in rows for entry in row))[1:]
        return np.stack(columns, axis=-1).reshape(*self.k1.shape, 3, 3)

    @cached_property
    def energy_density(self) -> np.ndarray:
        """Energy of the strain per length [GJ/L^2], (...)."""
        return np.asarray(self.law.energy_density(components(self.strain), components(self.moment_body)))

    @cached_property
    def energy_density_parts(self) -> tuple[np.ndarray, np.ndarray]:
        """What of it is bending and what is twist, (...) each."""
        one, two, twist = self.law.energy_parts(components(self.strain), components(self.moment_body))
        return one + two, twist

    def in_space(self, body: np.ndarray) -> np.ndarray:
        """Space components (..., 3) of a field of body components."""
        return np.einsum("...da,...d->...a", self.directors, body)

    # -- the state as a whole -----------------------------------------------------------------------------------------

    @property
    def height(self) -> float:
        """int y ds."""
        return float(self.solution.observables["height"])

    @property
    def energy(self) -> float:
        """Energy of the strain, and that of the load where there is one [GJ/L]."""
        return float(self.solution.observables["energy"])

    @cached_property
    def load(self) -> np.ndarray:
        """(3,) dead load per length in space [GJ/L^3]."""
        return self._reader.load(parameters_of(self.solution))

    @cached_property
    def energy_parts(self) -> tuple[float, float]:
        """Bending and twisting energy [GJ/L]."""
        bending, twist = self.at_gauss_points().energy_density_parts
        return self.solution.mean(bending), self.solution.mean(twist)

    @cached_property
    def first_integrals(self) -> dict[str, np.ndarray]:
        r"""What is constant along a rod of one law and one dead load f, at the places, (...) each.

        Without load N.N, N.M and H + N3, where H = M.k - W; with it n + f s in space, by components, and
        H + N3 + f.X.
        """
        density = np.einsum("...a,...a->...", self.moment_body, self.strain) - self.energy_density
        if self.load.any():
            force = self.force + np.multiply.outer(self.s, self.load)
            fields = {f"n{axis}+f{axis}s": force[..., i] for i, axis in enumerate("xyz")}
            return {**fields, "H+N3+f.X": density + self.tension + self.position @ self.load}
        return {
            "N.N": np.einsum("...a,...a->...", self.force_body, self.force_body),
            "N.M": np.einsum("...a,...a->...", self.force_body, self.moment_body),
            "H+N3": density + self.tension,
        }

    @cached_property
    def inflections(self) -> dict[str, int]:
        """Number of sign changes of k1 and of tau inside the rod; a strain below 1e-6 of the largest counts as zero."""
        inside = self.at(np.linspace(0.0, 1.0, 801)[1:-1])
        strains = {"k1": inside.k1, "tau": inside.tau}
        floor = 1e-6 * max(np.abs(v).max() for v in strains.values())
        return {name: count_sign_changes(v, floor) for name, v in strains.items()}

    @cached_property
    def asymmetry(self) -> float:
        """Largest difference of the strain and that of the reversed rod, relative to the largest strain.

        Reversal, s -> 1 - s with half a turn about d2, changes the sign of k2 only.
        """
        s = np.linspace(0.0, 0.5, 21)
        strain = self.at(np.concatenate([s, 1.0 - s])).strain
        difference = np.abs(strain[: len(s)] - strain[len(s) :] * [1.0, -1.0, 1.0]).max()
        return float(difference / max(np.abs(strain).max(), 1e-300))

    @property
    def symmetric(self) -> bool:
        """Whether the strain is that of the reversed rod: between clamps tilted alike, whether the state is."""
        return self.asymmetry < SYMMETRIC


def count_sign_changes(values: np.ndarray, floor: float) -> int:
    """Sign changes of samples, those of size below the floor skipped."""
    kept = values[np.abs(values) > floor]
    return int(np.sum(np.sign(kept[1:]) != np.sign(kept[:-1])))
