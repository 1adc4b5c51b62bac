"""A problem that is no rod as a model of the atlas: the shallow arch of the examples, whose states are known on paper.

Fung & Kaplan (1952), see `examples/arch.py`: symmetric states have q/pi^4 = h - a + a (h^2 - a^2), limit loads at
a^2 = (h^2 - 1)/3, and branch points where a^2 = h^2 - 4.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np

from rodatlas.continuation import BVP, Solution, Symmetry
from rodatlas.model import Control, Model, Quantity, Seed, Setting, register
from rodatlas.model.model import Source

_spec = spec_from_file_location("arch_example", Path(__file__).parents[1] / "examples" / "arch.py")
example = module_from_spec(_spec)
_spec.loader.exec_module(example)

PI = np.pi
MODES = np.arange(1, 31)


def symmetric_arch() -> BVP:
    """The arch, with the exchange of its halves declared."""
    return example.arch(symmetries=(Symmetry("reversal", {"slope": -1, "third": -1}, reverse=True),))


def starts(setting: Setting, tolerance: float, keep: object) -> tuple[list[Seed], list[str]]:
    bvp = example.arch()
    return [Seed("unloaded", Solution.from_function(example.unloaded, bvp.unknowns, bvp.parameters))], []


def index(solution: Solution) -> int:
    """Negative eigenvalues of the second variation of int (w'' - w0'')^2/2 + N^2/8 + q w sin(pi x), in sines."""
    s = np.linspace(0.0, 1.0, 2001)
    slope = solution(s)[:, 1]
    coupled = np.array([np.trapezoid(slope * n * PI * np.cos(n * PI * s), s) for n in MODES])
    n = MODES * PI
    hessian = np.diag(n**4 / 2 - solution["N"] * n**2 / 2) + 4 * np.outer(coupled, coupled)
    return int((np.linalg.eigvalsh(hessian) < 0).sum())


def _model(name: str, build: Callable[[], BVP]) -> Model:
    return Model(
        name, build,
        (Control("rise", "h", "h", 3.0, usual=lambda at: (0.5, 4.0)),
         Control("load", "q", r"q/\pi^4", 0.0, scale=PI**-4, usual=lambda at: (-6.0, 15.0))),
        (Quantity.of("a", what="amplitude"),), (Source("unloaded", starts),), free=("N",), index=index,
    )  # fmt: skip


@register
def arch_model() -> Model:
    """With its symmetry."""
    return _model("arch", symmetric_arch)


@register
def bare_arch_model() -> Model:
    """The same problem, of which the atlas is told no symmetry."""
    return _model("bare arch", example.arch)


def limit_loads(h: float) -> tuple[float, float]:
    """q/pi^4 at the two folds."""
    part = 2 * ((h**2 - 1) / 3) ** 1.5
    return h - part, h + part


def buckling_loads(h: float) -> tuple[float, float]:
    """q/pi^4 at the branch points a = -+ sqrt(h^2 - 4)."""
    a = np.sqrt(h**2 - 4)
    return h - 3 * a, h + 3 * a


def stable_count(h: float, load: float) -> int:
    """Number of stable states: symmetric ones whose index is zero; asymmetric ones are never stable."""
    roots = np.roots([-1.0, 0.0, h**2 - 1.0, h - load])
    real = roots[np.abs(roots.imag) < 1e-9].real
    rises = 1.0 - h**2 + 3 * real**2 > 0  # dq/da < 0
    thrust = h**2 - real**2 < 4.0  # N < 4 pi^2
    return int((rises & thrust).sum())
