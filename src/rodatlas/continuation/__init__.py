"""Continuation of two-point boundary value problems, usable alone.

>>> from rodatlas.continuation import BVP, Solution, TraceOptions, solve, trace
"""

from rodatlas.continuation.curve.deflation import deflated_solve, other_solutions
from rodatlas.continuation.curve.options import StepControl, TraceOptions
from rodatlas.continuation.curve.sensitivity import sensitivity
from rodatlas.continuation.curve.start import NotConverged
from rodatlas.continuation.curve.switch import switch, switch_all
from rodatlas.continuation.curve.trace import follow, solve, trace
from rodatlas.continuation.discrete.mesh import MeshControl
from rodatlas.continuation.discrete.newton import NewtonCode, NewtonOptions
from rodatlas.continuation.discrete.solution import Solution
from rodatlas.continuation.locus.follow import follow_locus
from rodatlas.continuation.locus.switch import fold_locus_at
from rodatlas.continuation.problem.bvp import BVP
from rodatlas.continuation.problem.continuous import ContinuousSymmetry, is_symmetry
from rodatlas.continuation.problem.functions import erf, tabulated
from rodatlas.continuation.problem.layout import Inner
from rodatlas.continuation.problem.observable import end_value, integral_of, value_at
from rodatlas.continuation.problem.symmetry import Symmetry
from rodatlas.continuation.results.branch import Branch, Discrepancy, EndReason, NormalForm, Point, SpecialPoint, Status
from rodatlas.continuation.results.locus import Effect, Locus, LocusEvent, LocusPoint
from rodatlas.continuation.symmetric.isotropy import broken_at, image, isotropy

__all__ = [
    "BVP", "Branch", "ContinuousSymmetry", "Discrepancy", "Effect", "EndReason", "Inner", "Locus", "LocusEvent",
    "LocusPoint", "MeshControl", "NewtonCode", "NewtonOptions", "NormalForm", "NotConverged", "Point", "Solution",
    "SpecialPoint", "Status", "StepControl", "Symmetry", "TraceOptions", "broken_at", "deflated_solve", "end_value",
    "erf", "fold_locus_at", "follow", "follow_locus", "image", "integral_of", "is_symmetry", "isotropy",
    "other_solutions", "sensitivity", "solve", "switch", "switch_all", "tabulated", "trace", "value_at",
]  # fmt: skip
