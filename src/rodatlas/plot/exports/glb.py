"""GLB, the binary form of glTF 2.0: for web pages, Blender, PowerPoint and viewers of operating systems."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rodatlas.files import replace_file
from rodatlas.plot.exports.mesh import Mesh

FLOAT, UNSIGNED = 5126, 5125  # types of components
VERTICES, INDICES = 34962, 34963  # uses of a buffer view


def write_glb(
    path: str | os.PathLike[str], meshes: Mapping[str, tuple[Mesh, tuple[float, float, float]]], scale: float = 1.0
) -> Path:
    """Write meshes into one scene, a node of its own name for each, visible from both sides.

    Parameters
    ----------
    meshes : name -> sheet and its color (red, green, blue from 0 to 1, as displayed).
    scale : meters for each unit of the meshes' lengths; glTF has y upward and lengths in meters.
    """
    if not meshes:
        raise ValueError("meshes: expected at least one, got none")
    buffer = _Buffer()
    nodes, bodies, materials = [], [], []
    for i, (name, (mesh, color)) in enumerate(meshes.items()):
        attributes = {"POSITION": buffer.add(mesh.vertices.astype("<f4"), VERTICES)}
        if mesh.normals is not None:
            attributes["NORMAL"] = buffer.add(mesh.normals.astype("<f4"), VERTICES)
        indices = buffer.add(mesh.triangles.astype("<u4").ravel(), INDICES)
        bodies.append({"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": i}]})
        materials.append(_material(name, color))
        nodes.append({"name": name, "mesh": i, "scale": [scale] * 3})
    scene = {
        "asset": {"version": "2.0", "generator": "rodatlas"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": bodies,
        "materials": materials,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(scene, separators=(",", ":")).encode()
    chunks = _chunk(b"JSON", text, b" ") + _chunk(b"BIN\0", bytes(buffer.data), b"\0")
    head = b"glTF" + np.array([2, 12 + len(chunks)], "<u4").tobytes()
    return replace_file(path, head + chunks)


class _Buffer:
    """Arrays one after another, with the entries that tell where each lies and what it holds."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: np.ndarray, use: int) -> int:
        """Append an array of 4-byte numbers; its position among the accessors."""
        raw = array.tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": use})
        entry: dict[str, Any] = {
            "bufferView": len(self.views) - 1, "count": len(array), "type": "VEC3" if array.ndim == 2 else "SCALAR",
            "componentType": FLOAT if array.dtype.kind == "f" else UNSIGNED,
        }  # fmt: skip
        if array.ndim == 2:
            entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        self.accessors.append(entry)
        self.data += raw
        return len(self.accessors) - 1


def _material(name: str, color: tuple[float, float, float]) -> dict[str, Any]:
    """A matt surface; glTF wants colors as amounts of light, not as displayed (sRGB)."""
    light = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in color]
    surface = {"baseColorFactor": [*light, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6}
    return {"name": name, "doubleSided": True, "pbrMetallicRoughness": surface}


def _chunk(kind: bytes, content: bytes, filler: bytes) -> bytes:
    """Length, kind and content, filled up to a multiple of four bytes."""
    padded = content + filler * (-len(content) % 4)
    return np.array(len(padded), "<u4").tobytes() + kind + padded
