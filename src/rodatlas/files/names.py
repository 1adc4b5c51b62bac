"""Names of files that tell all settings apart: numbers written exactly, and digests of what decides a result."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping


def exact(number: float) -> str:
    """The shortest text that stands for a number and no other: '15', '27.5', '1e-08'; never '-0'."""
    text = repr(float(number) + 0.0)
    return text.removesuffix(".0")


def digest(identity: Mapping[str, object]) -> str:
    """Eight hexadecimal digits that stand for an identity; 15 and 15.0 are the same."""
    plain = {key: float(v) if isinstance(v, int) and not isinstance(v, bool) else v for key, v in identity.items()}
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:8]
