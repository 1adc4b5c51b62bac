"""Fixtures that several test folders share: computed once per worker."""

import pytest

from rodatlas.atlas import SliceSettings, compute_slice


@pytest.fixture(scope="session")
def slice_15():
    return compute_slice(SliceSettings(15.0))


@pytest.fixture(scope="session")
def slice_30():
    return compute_slice(SliceSettings(30.0))
