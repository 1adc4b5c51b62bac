"""Fixtures of the atlas: computed once per worker."""

import pytest

from rodatlas.atlas import LociSettings, compute_loci


@pytest.fixture(scope="session")
def loci(slice_15):
    """The loci that the slice at 15 degrees leads to: all but 16 and 17, which need slices of their own."""
    numbers = [n for n in range(3, 19) if n not in (16, 17)]
    return compute_loci(LociSettings(), lambda angle: slice_15, numbers)
