"""A digest of a boundary value problem: what a stored result was computed for."""

from __future__ import annotations

import hashlib
import json

from rodatlas.continuation.problem.bvp import BVP


def fingerprint(bvp: BVP) -> str:
    """Twelve hexadecimal digits that stand for a problem: its traced functions, names, scales and symmetries.

    Equal problems have equal ones, in every process; a changed equation, condition, observable or symmetry has another.
    Default values of parameters do not matter.
    """
    names = [*bvp.unknowns, "", *bvp.parameter_names, "", *bvp.observables, "", *bvp.symmetries]
    found = hashlib.sha256(json.dumps([names, dict(bvp.scales)], sort_keys=True, default=float).encode())
    for function in (bvp.traced.field, bvp.traced.ends, bvp.traced.densities, bvp.traced.values, bvp.traced.identities):
        if function is not None and hasattr(function, "serialize"):
            found.update(function.serialize().encode())
    for action in bvp.symmetries.values():
        found.update(action.matrix.tobytes() + bytes([action.reverse]))
    return found.hexdigest()[:12]
