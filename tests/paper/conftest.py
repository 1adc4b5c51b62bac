"""One folder of results for all tests of figures: it holds the slices that other tests share, too."""

import pytest

from rodatlas.paper.sources import Sources


@pytest.fixture(scope="session")
def folder(tmp_path_factory, slice_15, slice_30):
    path = tmp_path_factory.mktemp("paper")
    slice_15.save(path / "slice-15.h5")
    slice_30.save(path / "slice-30.h5")
    return path


@pytest.fixture(scope="session")
def sources(folder):
    return Sources(folder)
