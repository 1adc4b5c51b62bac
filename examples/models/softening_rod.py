r"""A rod that softens as it is bent, with a law of its own, through the atlas of any rod.

    python examples/models/softening_rod.py

The package knows linear laws. This one is written here: the curvature about the width grows faster than the moment,

.. math:: \kappa_1 = M_1/a + g M_1^3, \qquad \kappa_2 = c_2 M_2, \qquad \tau = M_3,

as of a metal strip near yield (W. Ramberg and W. R. Osgood (1943), NACA Technical Note 902, with a cubic in place
of their power). Its complementary energy is H = M_1^2/(2a) + g M_1^4/4 + c_2 M_2^2/2 + M_3^2/2; W = M.k - H. The rod
held between the clamps of Yu and Hanna. With g = 0 and c2 = 0 it is their band.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rodatlas.atlas import Slice, SliceSettings, compute_slice
from rodatlas.model import Control, Model, Seed, Setting, Source, register
from rodatlas.rods import Clamps, ElasticRod, Ends, RodState, elastic_rod, rod_model, state_at
from rodatlas.rods.elastic import SYMMETRIES

A, C2 = 0.625, 0.001  # EI1/GJ of a thin band with Poisson's ratio 1/4; a band hardly bends about its normal


@dataclass(frozen=True)
class SofteningLaw:
    """The law above; numbers, arrays and symbols alike."""

    a: Any
    c2: Any
    g: Any

    @property
    def rigid(self) -> tuple[bool, bool, bool]:
        return False, False, False

    def strain(self, moment: Sequence[Any]) -> list[Any]:
        m1, m2, m3 = moment
        return [m1 / self.a + self.g * m1**3, self.c2 * m2, m3]

    def moment(self, strain: Sequence[Any], reaction: Sequence[Any]) -> list[Any]:
        raise NotImplementedError("of a rod whose unknowns are moments nobody asks")

    def energy_density(self, strain: Sequence[Any], moment: Sequence[Any]) -> Any:
        return sum(self.energy_parts(strain, moment))

    def energy_parts(self, strain: Sequence[Any], moment: Sequence[Any]) -> list[Any]:
        m1, m2, m3 = moment
        return [m1**2 / (2 * self.a) + 3 * self.g * m1**4 / 4, self.c2 * m2**2 / 2, m3**2 / 2]

    def compliance(self, moment: Sequence[Any]) -> list[list[Any]]:
        return [[1 / self.a + 3 * self.g * moment[0] ** 2, 0.0, 0.0], [0.0, self.c2, 0.0], [0.0, 0.0, 1.0]]


def softening_rod() -> ElasticRod:
    """The problem, and how its solutions are read."""
    parameters = {"a": A, "c2": C2, "g": 0.0, **Ends(15.0).parameters}
    clamps = [name for name in parameters if name not in ("a", "c2", "g")]
    return elastic_rod(
        lambda p: SofteningLaw(p.a, p.c2, p.g), lambda p: Clamps.changed(*(getattr(p, name) for name in clamps)),
        parameters, symmetries=SYMMETRIES, name="softening rod",
    )  # fmt: skip


@register
def softening_model() -> Model:
    """The model: three controls, and branches that start at the planar states of the linear band."""
    rod = softening_rod()

    def planar(setting: Setting, tolerance: float, keep: object) -> tuple[list[Seed], list[str]]:
        seeds = []
        for family in ("U", "W"):
            state = RodState(state_at(Ends(setting["angle"]), family))
            seeds.append(Seed(family, state.rewritten(rod.formulation, c2=C2, g=0.0)))
        return seeds, []

    controls = (
        Control("angle", "psi0", r"\psi_0", 15.0, "deg", usual=lambda at: (0.0, 80.0), what="clamp angle"),
        Control("softening", "g", "g", 0.0, usual=lambda at: (0.0, 0.005), what="softening"),
        Control("shear", "dD", r"\Delta D", 0.0, usual=lambda at: (-0.05, 0.45), what="shear"),
    )
    return rod_model("softening rod", rod, controls, [Source("planar states", planar)], pairing=("reversal",))


def main() -> list[Slice]:
    """Slices along the shear of the linear and of a softening rod: where U and W lose their symmetry."""
    found = []
    for softening in (0.0, 0.002):
        settings = SliceSettings.of(softening_model(), softening=softening)
        found.append(compute_slice(settings))
        print(found[-1])
        for branch in found[-1].branches[:2]:
            for event in branch.events:
                print(f"  on {branch.id}: {event!r}")
    return found


if __name__ == "__main__":
    assert math.isclose(A, (1 + 0.25) / 2)
    main()
