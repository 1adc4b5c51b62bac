"""Shapes and tables for other programs, read back by others: they have the area and the volume that they must have."""

import base64
import json
import xml.etree.ElementTree as ET

import numpy as np
import pandas as pd
import pytest
import trimesh

from rodatlas.continuation import Solution, solve
from rodatlas.paper.model import band_loci
from rodatlas.plot.band.surface import band_surface
from rodatlas.plot.exports import (
    box,
    loci_tables,
    point_fields,
    sheet,
    slice_tables,
    solution_table,
    with_millimeters,
    write_csv,
    write_glb,
    write_stl,
    write_vtp,
)
from rodatlas.plot.exports.mesh import ACROSS
from rodatlas.rods import mirror_shear, reverse, rod_problem

LENGTH, THICKNESS = 240.0, 0.127  # mm


@pytest.fixture(scope="module")
def planar(slice_15):
    """U at dD = 0, a plane curve."""
    return next(s for s in slice_15.state("U", 0.0).solutions if s["dD"] == 0.0)


@pytest.fixture(scope="module")
def twisted(slice_15):
    """TU near dD = 0.05, the most twisted state."""
    return min(slice_15.state("TU+-", 0.05).solutions, key=lambda s: abs(s["dD"] - 0.05))


def exact_area(solution, width):
    """int int sqrt(1 + v^2 tau^2) dv ds over the ruled surface X + v d1."""
    s, v = np.linspace(0, 1, 4001), np.linspace(-0.5, 0.5, 401) * width
    tau = solution(s, "tau")
    return np.trapezoid(np.trapezoid(np.sqrt(1 + np.outer(tau, v) ** 2), v, axis=1), s)


def test_a_plane_band_has_the_area_of_the_flat_one(planar):
    errors = [sheet(band_surface(planar, 1 / 8, n)).area * 8 - 1 for n in (121, 241, 481)]
    assert abs(errors[-1]) < 1e-5
    ratios = np.array(errors[:-1]) / errors[1:]
    assert ratios == pytest.approx([4.0, 4.0], rel=0.01)  # chords of arcs: second order


def test_area_and_edges_of_a_twisted_band(twisted):
    width = 1 / 8
    surface = band_surface(twisted, width, 961)
    exact = exact_area(twisted, width)
    assert sheet(surface).area == pytest.approx(exact, rel=2e-3)  # 0.05/36 by strips instead of a curved surface
    assert exact > 1.02 * width
    edges = np.linalg.norm(np.diff(surface.vertices, axis=0), axis=2).sum(axis=0)
    s = np.linspace(0, 1, 4001)
    length = np.trapezoid(np.sqrt(1 + (0.5 * width * twisted(s, "tau")) ** 2), s)
    assert edges == pytest.approx([length, length], rel=5e-5)


@pytest.mark.parametrize("width", [1 / 80, 1 / 8])
def test_the_solid_is_closed_and_has_the_volume_of_the_flat_band(planar, twisted, width, tmp_path):
    thickness = THICKNESS / LENGTH
    for solution in (planar, twisted):
        errors = [box(band_surface(solution, width, n), thickness).volume / (width * thickness) - 1 for n in (241, 481)]
        assert abs(errors[1]) < 1e-4
        assert errors[0] / errors[1] > 3.5
    path = write_stl(tmp_path / "band.stl", box(band_surface(twisted, width, 481), thickness, LENGTH))
    read = trimesh.load(path)
    assert read.is_watertight
    assert read.is_winding_consistent
    assert read.volume == pytest.approx(LENGTH**3 * width * thickness, rel=1e-3)  # positive: normals point outward
    assert read.euler_number == 2


def test_congruent_states_have_congruent_solids(twisted):
    first = box(band_surface(twisted, 1 / 8, 241), 1e-3)
    for other in (reverse(twisted), mirror_shear(twisted)):
        second = box(band_surface(other, 1 / 8, 241), 1e-3)
        assert second.area == pytest.approx(first.area, rel=1e-6)
        assert second.volume == pytest.approx(first.volume, rel=1e-4)


def test_thickness_must_be_positive(planar):
    with pytest.raises(ValueError, match=r"^thickness: expected a positive number, got 0"):
        box(band_surface(planar), 0.0)


def test_glb_is_a_scene_in_meters(planar, twisted, tmp_path):
    colors = {"U": (0.0, 0.5, 1.0), "TU+": (1.0, 0.0, 0.0)}
    surfaces = {"U": band_surface(planar, 1 / 8), "TU+": band_surface(twisted, 1 / 8)}
    path = write_glb(
        tmp_path / "two.glb", {name: (sheet(x, LENGTH), colors[name]) for name, x in surfaces.items()}, 1e-3
    )
    scene = trimesh.load(path)
    assert set(scene.geometry) == {"U", "TU+"}
    assert scene.bounds[1, 0] == pytest.approx(0.12, abs=1e-4)  # the right clamp
    for name, mesh in scene.geometry.items():
        assert mesh.area == pytest.approx(sheet(surfaces[name], LENGTH).area, rel=1e-5)
        assert mesh.vertex_normals @ [0.0, 1.0, 0.0] == pytest.approx(
            np.repeat(surfaces[name].directors[1][:, 1], ACROSS + 1), abs=1e-6
        )
    seen = {name: mesh.visual.material.baseColorFactor for name, mesh in scene.geometry.items()}
    assert list(seen["TU+"]) == [255, 0, 0, 255]
    assert seen["U"][1] == pytest.approx(255 * 0.214, abs=1)  # half of the displayed green is a fifth of the light
    raw = path.read_bytes()
    assert int.from_bytes(raw[8:12], "little") == len(raw)
    assert json.loads(raw[20 : 20 + int.from_bytes(raw[12:16], "little")])["asset"]["version"] == "2.0"
    with pytest.raises(ValueError, match=r"^meshes: expected at least one"):
        write_glb(path, {})


def arrays(path):
    """DataArrays of a VTP file by name."""
    kinds = {"Float64": "<f8", "Int64": "<i8"}
    found = {}
    for entry in ET.parse(path).getroot().iter("DataArray"):
        raw = base64.b64decode(entry.text)
        values = np.frombuffer(raw[8:], kinds[entry.attrib["type"]])
        assert int.from_bytes(raw[:8], "little") == len(raw) - 8
        components = int(entry.attrib["NumberOfComponents"])
        found[entry.attrib["Name"]] = values.reshape(-1, components) if components > 1 else values
    return found


def test_vtp_holds_the_surface_and_its_fields(twisted, tmp_path):
    surface = band_surface(twisted, 1 / 8, 121)
    mesh = sheet(surface, LENGTH)
    path = write_vtp(tmp_path / "band.vtp", mesh, point_fields(twisted, surface.s, LENGTH, "mm"))
    found = arrays(path)
    assert np.array_equal(found["Points"], mesh.vertices)
    assert np.array_equal(found["connectivity"].reshape(-1, 4), mesh.faces)
    assert np.array_equal(found["offsets"], 4 * np.arange(1, 120 * ACROSS + 1))
    # force in space is constant without body force; the moment balances it about any point
    force = found["N [GJ/L^2]"]
    assert np.ptp(force, axis=0).max() < 1e-3 * np.abs(force).max()
    arm = (surface.centerline - surface.centerline[0])[[0, 60, 120]]
    moment = found["M [GJ/L]"][:: ACROSS + 1][[0, 60, 120]]
    assert moment + np.cross(arm, force[0]) == pytest.approx(np.tile(moment[0], (3, 1)), abs=1e-4 * 60)
    energy = np.trapezoid(found["energy density [GJ/L^2]"][:: ACROSS + 1], surface.s)
    assert energy == pytest.approx(twisted["energy"], rel=1e-3)
    assert found["k1 [1/mm]"][:: ACROSS + 1] * LENGTH == pytest.approx(twisted(surface.s, "k1"))
    with pytest.raises(ValueError, match=r"^x: expected 847 values, one for each vertex, got 3"):
        write_vtp(path, mesh, {"x": np.zeros(3)})


def test_vtk_reads_the_surface(twisted, tmp_path):
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    path = write_vtp(tmp_path / "band.vtp", sheet(band_surface(twisted, 1 / 8, 121)))
    reader = xml.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetOutput().GetNumberOfPolys() == 120 * ACROSS
    assert reader.GetOutput().GetPointData().GetNormals().GetName() == "Normals"


def test_a_solution_from_its_table_is_solved_at_once(twisted, tmp_path):
    """The CSV file is as good as the state: as a guess it is 1e-5 away from it."""
    frame, comments = solution_table(twisted)
    path = write_csv(tmp_path / "u.csv", frame, comments, bare=True)
    assert np.loadtxt(path, delimiter=",").shape == (201, 14)
    parameters = dict(zip(twisted.parameter_names, twisted.parameters, strict=True))
    guess = Solution.from_table(path, twisted.unknowns, parameters)
    assert np.abs(guess(0.37) - twisted(0.37)).max() < 1e-3
    plain = Solution.from_table(write_csv(path, frame, comments), twisted.unknowns, parameters)
    assert np.array_equal(plain.values, guess.values)
    assert solve(rod_problem(), guess)["energy"] == pytest.approx(twisted["energy"], rel=1e-7)


def test_tables_of_a_slice(slice_15, tmp_path):
    tables = slice_tables(slice_15)
    assert {name: len(t) for name, t in tables.items()} == {
        "states": len(slice_15.states),
        "events": sum(len(b.events) for b in slice_15.branches),
        "branches": sum(len(b.followed.branch) + len(b.followed.branch.special) for b in slice_15.branches),
    }
    path = write_csv(tmp_path / "events.csv", with_millimeters(tables["events"], LENGTH), ["a note"])
    read = pd.read_csv(path, comment="#")
    four = read[read["number"] == 4].iloc[0]
    assert four["shear_mm"] == pytest.approx(240 * 0.327675302, abs=1e-6)
    assert (four["index_before"], four["index_after"]) == (0, 1)


def test_tables_of_loci(slice_15):
    from rodatlas.atlas import compute_loci

    loci = compute_loci(band_loci(angle_max=16.0), lambda angle: slice_15, (4,))
    points = loci_tables(loci)["points"]
    four = points[points["number"] == 4]
    assert four["angle_deg"].is_monotonic_increasing
    at = np.interp(15.0, four["angle_deg"], four["shear"])
    assert at == pytest.approx(0.327675302, abs=1e-4)


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    from pathlib import Path

    path = write_csv(tmp_path / "a.csv", pd.DataFrame({"x": [1.0]}))

    def full(self, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        write_csv(path, pd.DataFrame({"x": [2.0]}))
    assert path.read_text() == "x\n1\n"
    assert list(tmp_path.iterdir()) == [path]
