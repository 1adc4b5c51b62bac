"""Slices carry states from the slice at 15 degrees; one that the folder has already gives the same result."""

import pytest

from rodatlas.atlas import compute_slice
from rodatlas.atlas.slices.obtain import obtain_slice
from rodatlas.paper.model import band_slice


@pytest.mark.slow
def test_the_reference_is_read_from_the_folder(tmp_path):
    """What is there is not followed again: no branch of the reference is begun."""
    settings = band_slice(30.0, shear_max=0.4, search=0)
    alone = compute_slice(settings)
    obtain_slice(settings.at(angle=15.0), tmp_path)
    said = []
    found = obtain_slice(settings, tmp_path, lambda message, done, pending: said.append(message))
    assert found.to_json() | {"seconds": 0} == alone.to_json() | {"seconds": 0}
    assert any(b.id.startswith("U@15") or "@15" in b.id for b in found.branches)  # something was carried
    assert any(message.startswith("branch") for message in said)
    assert not any(message.startswith("reference slice") for message in said)
