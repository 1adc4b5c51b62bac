"""Continuation of two-point boundary value problems, usable alone.

>>> from rodatlas.continuation import BVP, Solution, TraceOptions, solve, trace
"""

from rodatlas.continuation.deflation import deflated_solve, other_solutions
from rodatlas.continuation.isotropy import broken_at, image, isotropy
from rodatlas.continuation.locus import follow_locus
from rodatlas.continuation.locus_results import Locus, LocusEvent, LocusPoint
from rodatlas.continuation.locus_switch import fold_locus_at
from rodatlas.continuation.mesh import MeshControl
from rodatlas.continuation.newton import NewtonCode, NewtonOptions
from rodatlas.continuation.options import StepControl, TraceOptions
from rodatlas.continuation.problem import BVP, end_value, integral_of
from rodatlas.continuation.results import Branch, Discrepancy, EndReason, NormalForm, Point, SpecialPoint, Status
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.start import NotConverged
from rodatlas.continuation.switch import switch, switch_all
from rodatlas.continuation.symmetry import Symmetry
from rodatlas.continuation.trace import follow, solve, trace

__all__ = [
    "BVP", "Branch", "Discrepancy", "EndReason", "Locus", "LocusEvent", "LocusPoint", "MeshControl", "NewtonCode",
    "NewtonOptions", "NormalForm", "NotConverged", "Point", "Solution", "SpecialPoint", "Status", "StepControl",
    "Symmetry", "TraceOptions", "broken_at", "deflated_solve", "end_value", "fold_locus_at", "follow", "follow_locus",
    "image", "integral_of", "isotropy", "other_solutions", "solve", "switch", "switch_all", "trace",
]  # fmt: skip
