"""VTP, the polygons of VTK as XML: for ParaView, PyVista and whatever is built on VTK."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from rodatlas.continuation.checks import check_type
from rodatlas.files import replace_file
from rodatlas.plot.exports.mesh import ACROSS, Mesh

if TYPE_CHECKING:
    from rodatlas.continuation import Solution


def point_fields(solution: Solution, s: np.ndarray, length: float = 1.0, unit: str = "L") -> dict[str, np.ndarray]:
    """Fields at the vertices of a band's sheet, the same all across the width; the names tell the units.

    Parameters
    ----------
    s : (n,) cross-sections.
    length, unit : the rod length in the unit of the mesh, and the name of that unit.

    Returns
    -------
    name -> (k n,) or (k n, 3), k vertices in each cross-section: arclength, curvature, twist, force and
        moment in space, energy density.
    """
    from rodatlas.rods.state import RodState

    state = RodState(solution).at(s)
    fields = {
        f"s [{unit}]": length * s,
        f"k1 [1/{unit}]": state.k1 / length,
        f"tau [1/{unit}]": state.tau / length,
        "N [GJ/L^2]": state.force,
        "M [GJ/L]": state.moment,
        "energy density [GJ/L^2]": state.energy_density,
    }
    return {name: np.repeat(field, ACROSS + 1, axis=0) for name, field in fields.items()}


def write_vtp(path: str | os.PathLike[str], mesh: Mesh, fields: Mapping[str, np.ndarray] | None = None) -> Path:
    """Write a mesh with fields at its vertices, (n,) each or (n, 3).

    Raises
    ------
    ValueError
        when a field has another number of rows than the mesh has vertices.
    """
    check_type("mesh", mesh, Mesh, "a Mesh, see sheet and box")
    fields = dict(fields or {})
    for name, field in fields.items():
        if len(field) != len(mesh.vertices):
            raise ValueError(f"{name}: expected {len(mesh.vertices)} values, one for each vertex, got {len(field)}")
    if mesh.normals is not None:
        fields["Normals"] = mesh.normals
    corners = mesh.faces.shape[1]
    offsets = corners * np.arange(1, len(mesh.faces) + 1)
    body = "\n".join([
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<PolyData>",
        f'<Piece NumberOfPoints="{len(mesh.vertices)}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" '
        f'NumberOfPolys="{len(mesh.faces)}">',
        "<PointData>" if mesh.normals is None else '<PointData Normals="Normals">',
        *(_array(name, field, "<f8") for name, field in fields.items()),
        "</PointData>",
        "<Points>", _array("Points", mesh.vertices, "<f8"), "</Points>",
        "<Polys>", _array("connectivity", mesh.faces.ravel(), "<i8"), _array("offsets", offsets, "<i8"), "</Polys>",
        "</Piece>", "</PolyData>", "</VTKFile>", "",
    ])  # fmt: skip
    return replace_file(path, body.encode())


def _array(name: str, values: np.ndarray, kind: str) -> str:
    """A DataArray in base64: the number of bytes, then the bytes."""
    raw = np.ascontiguousarray(values, kind).tobytes()
    text = base64.b64encode(np.array(len(raw), "<u8").tobytes() + raw).decode()
    components = values.shape[1] if values.ndim == 2 else 1
    vtk = {"<f8": "Float64", "<i8": "Int64"}[kind]
    label = quoteattr(name)
    return f'<DataArray type="{vtk}" Name={label} NumberOfComponents="{components}" format="binary">{text}</DataArray>'
