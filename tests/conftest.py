"""Fixtures that several test folders share: computed once, by one of the workers, and read by the others."""

import pytest

import one_thread  # noqa: F401  (before anything that loads NumPy)
import small_results
from rodatlas.atlas.loci.obtain import obtain_loci
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.paper.model import band_loci, band_slice


@pytest.hookimpl(tryfirst=True)  # before `-m "not slow"` takes some of them out
def pytest_collection_modifyitems(items):
    """Files with slow tests come first: whatever is begun last is short, and no process is idle for long at the end."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


@pytest.fixture(scope="session")
def shared(tmp_path_factory, worker_id):
    """A folder for results that all workers use; who needs one that another is computing waits for it."""
    own = tmp_path_factory.getbasetemp()
    folder = (own if worker_id == "master" else own.parent) / "shared"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def slice_15(shared):
    return obtain_slice(band_slice(15.0), shared)


@pytest.fixture(scope="session")
def slice_30(shared):
    return obtain_slice(band_slice(30.0), shared)


@pytest.fixture(scope="session")
def near_zero(shared):
    """A slice that takes a few seconds: four named states at 15 degrees next to zero shear."""
    return obtain_slice(band_slice(15.0, shear_max=0.02, shear_min=0.0, tolerance=1e-6, search=0), shared)


@pytest.fixture(scope="session")
def slice_60(shared):
    """Only what goes on to high shear is carried over and followed; a search is left out, which finds nothing more."""
    return obtain_slice(band_slice(60.0, search=0), shared)


@pytest.fixture(scope="session")
def loci(shared):
    """The loci that the slice at 15 degrees leads to: all but 16 and 17, which need slices of their own."""
    return obtain_loci(band_loci(), shared, [n for n in range(19) if n not in (16, 17)])


@pytest.fixture(scope="session")
def few_loci(slice_15):
    """Loci of the pitchforks 4 and 11 and of fold 12."""
    return small_results.few_loci(slice_15)


@pytest.fixture
def small(monkeypatch, slice_15, request):
    """Everything that takes minutes gives a small result at once, see the module; loci are traced when asked for."""
    small_results.replace_computations(monkeypatch, slice_15, lambda: request.getfixturevalue("few_loci"))
