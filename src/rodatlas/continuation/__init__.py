"""Continuation of two-point boundary value problems, usable alone.

>>> from rodatlas.continuation import BVP, Solution, TraceOptions, solve, trace
"""

from rodatlas.continuation.locus import follow_locus
from rodatlas.continuation.locus_results import Locus, LocusEvent, LocusPoint
from rodatlas.continuation.mesh import MeshControl
from rodatlas.continuation.newton import NewtonCode, NewtonOptions
from rodatlas.continuation.options import StepControl, TraceOptions
from rodatlas.continuation.problem import BVP, end_value, integral_of
from rodatlas.continuation.results import Branch, Discrepancy, EndReason, Point, SpecialPoint, Status
from rodatlas.continuation.solution import Solution
from rodatlas.continuation.trace import NotConverged, follow, solve, switch, trace

__all__ = [
    "BVP", "Branch", "Discrepancy", "EndReason", "Locus", "LocusEvent", "LocusPoint", "MeshControl",
    "NewtonCode", "NewtonOptions", "NotConverged", "Point", "Solution", "SpecialPoint", "Status", "StepControl",
    "TraceOptions", "end_value", "follow", "follow_locus", "integral_of", "solve", "switch", "trace",
]  # fmt: skip
