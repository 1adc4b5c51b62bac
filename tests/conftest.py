"""Fixtures that several test folders share: computed once per worker."""

import pytest

import small_results
from rodatlas.atlas import LociSettings, SliceSettings, compute_loci, compute_slice


@pytest.fixture(scope="session")
def slice_15():
    return compute_slice(SliceSettings(15.0))


@pytest.fixture(scope="session")
def slice_30():
    return compute_slice(SliceSettings(30.0))


@pytest.fixture(scope="session")
def loci(slice_15):
    """The loci that the slice at 15 degrees leads to: all but 16 and 17, which need slices of their own."""
    numbers = [n for n in range(19) if n not in (16, 17)]
    return compute_loci(LociSettings(), lambda angle: slice_15, numbers)


@pytest.fixture(scope="session")
def few_loci(slice_15):
    """Loci of the pitchforks 4 and 11 and of fold 12."""
    return small_results.few_loci(slice_15)


@pytest.fixture
def small(monkeypatch, slice_15, few_loci):
    """Everything that takes minutes gives a small result at once, see the module."""
    small_results.replace_computations(monkeypatch, slice_15, lambda: few_loci)
