"""Results for all tests of figures: those that other tests share, too."""

import pytest

from rodatlas.paper.sources import Sources


class Given(Sources):
    """Results that are there already; the loci 16 and 17 are missing."""

    def __init__(self, folder, slices, loci):
        super().__init__(folder)
        self.given, self._loci = slices, loci

    def slice_at(self, angle_deg, shear_max=None):
        return self.given[angle_deg]


@pytest.fixture(scope="session")
def folder(tmp_path_factory, slice_15, slice_30):
    """A folder with the slices that the figures at 15 and 30 degrees are drawn from."""
    path = tmp_path_factory.mktemp("paper")
    slice_15.save(path / "slice-15.h5")
    slice_30.save(path / "slice-30.h5")
    return path


@pytest.fixture(scope="session")
def sources(folder, slice_15, slice_30, loci):
    return Given(folder, {15.0: slice_15, 30.0: slice_30}, loci)
