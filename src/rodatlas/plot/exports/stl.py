"""STL, the format of 3D printers: triangles with their normals, binary, little-endian, 32-bit."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.files import replace_file
from rodatlas.plot.exports.mesh import Mesh

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: str | os.PathLike[str], mesh: Mesh, title: str = "rodatlas") -> Path:
    """Write a closed mesh as one solid: 80 bytes of title, the number of triangles, 50 bytes for each of them."""
    check_type("mesh", mesh, Mesh, "a Mesh, see sheet and box")
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    records = np.zeros(len(corners), TRIANGLE)
    records["normal"], records["corners"] = normals, corners
    # a title that starts with "solid" is taken for the text form of the format
    head = title.encode("ascii", "replace")[:80].ljust(80)
    return replace_file(path, head + np.array(len(corners), "<u4").tobytes() + records.tobytes())
