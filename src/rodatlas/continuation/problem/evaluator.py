"""Evaluation of one traced function at many points, without copies."""

from __future__ import annotations

import threading
from functools import lru_cache
from typing import Any

import numpy as np

_own = threading.local()  # evaluators of each thread: two that share buffers would mix up their numbers


class Evaluator:
    """Evaluates one traced function at `count` points through CasADi's copy-free buffers.

    Inputs and outputs are NumPy arrays with the point as first axis (an input without it is repeated); matrices
    come transposed (column-major per point). The output arrays belong to the evaluator and are overwritten by the
    next call.
    """

    def __init__(self, function: Any, count: int):
        self._buffer, self._call = _mapped(function, count).buffer()
        self._inputs = [np.zeros((count, function.numel_in(i))) for i in range(function.n_in())]
        self.outputs = [np.zeros((count, function.numel_out(i))) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, array.data)
        for i, array in enumerate(self.outputs):
            self._buffer.set_res(i, array.data)

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        for array, value in zip(self._inputs, arguments, strict=True):
            array[...] = value.reshape(array.shape) if value.size == array.size else value
        self._call()
        return self.outputs


def evaluator(function: Any, count: int) -> Evaluator:
    """The evaluator of a function at so many points; meshes of equal size share it, and its outputs, in one thread."""
    if not hasattr(_own, "kept"):
        _own.kept = lru_cache(maxsize=128)(Evaluator)
    made: Evaluator = _own.kept(function, count)
    return made


@lru_cache(maxsize=256)
def _mapped(function: Any, count: int) -> Any:
    """The function over `count` points; meshes of equal size share it."""
    return function if count == 1 else function.map(count)
