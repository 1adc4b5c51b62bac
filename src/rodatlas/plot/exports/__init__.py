"""Results as files that other programs read: tables (CSV), shapes for ParaView (VTP), for browsers and Blender (GLB),
and for printing (STL). Nothing but NumPy is needed to write them.
"""

from rodatlas.plot.exports.glb import write_glb
from rodatlas.plot.exports.mesh import Mesh, box, sheet
from rodatlas.plot.exports.stl import write_stl
from rodatlas.plot.exports.tables import (
    loci_tables,
    phase_tables,
    slice_tables,
    solution_table,
    with_millimeters,
    write_csv,
)
from rodatlas.plot.exports.vtp import point_fields, write_vtp

__all__ = [
    "Mesh", "box", "loci_tables", "phase_tables", "point_fields", "sheet", "slice_tables", "solution_table",
    "with_millimeters", "write_csv", "write_glb", "write_stl", "write_vtp",
]  # fmt: skip
