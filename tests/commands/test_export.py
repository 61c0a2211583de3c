"""Mesh files and the export command: closed bodies stay closed, stored results give before and after."""

import dataclasses
import errno
import json
import math
import os

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from matplotlib.image import imread as read_png
from stored_files import result, variable

from lpc_mdo.cli import main
from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.geometry.bodies import tube_surface
from lpc_mdo.geometry.mesh_files import quad_mesh, write_stl, write_vtk
from lpc_mdo.geometry.meshing import enclosed_volume
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.interop.shape_files import export_shape, stored_shapes, stored_vehicle
from lpc_mdo.reporting.figures import geometry_measures, outer_mold_line
from lpc_mdo.reporting.mold import mold_data
from lpc_mdo.reporting.views import FRONT, OBLIQUE, SIDE, TOP

VEHICLE, MISSION = load()
MOLD = OuterMoldLine(VEHICLE)
SURFACES = MOLD.surfaces(MOLD.control_points(MOLD.baseline_parameters()))


def read_stl(file):
    content = file.read_bytes()
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    count = int(np.frombuffer(content[80:84], dtype="<u4")[0])
    triangles = np.frombuffer(content[84:], dtype=record)
    assert len(triangles) == count
    return triangles


def test_triangles_enclose_the_volume_of_the_body_and_share_every_edge(tmp_path):
    own = {name: SURFACES[name] for name in MOLD.components["wing"]}
    write_stl(quad_mesh(own, 40), tmp_path / "wing.stl")
    triangles = read_stl(tmp_path / "wing.stl")
    corners = triangles["corners"].astype(float)
    volume = (corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(float(enclosed_volume(list(own.values()))), rel=5e-3)
    keys = np.round(corners * 1e5).astype(np.int64)  # single precision: 1e-6 m at 8 m
    edges = {}
    for triangle in keys:
        for a, b in ((0, 1), (1, 2), (2, 0)):
            edge = (tuple(triangle[a]), tuple(triangle[b]))
            edges[edge] = edges.get(edge, 0) + 1
    open_edges = [edge for edge, times in edges.items() if edges.get((edge[1], edge[0]), 0) != times]
    assert not open_edges
    sine = np.einsum(
        "ij,ij->i", triangles["normal"], np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    )
    assert sine.min() > 0.0


def test_vtk_file_holds_points_polygons_and_names(tmp_path):
    tube = tube_surface(torch.zeros(3).double(), torch.tensor([2.0, 0.0, 0.0]).double(), 0.5)
    mesh = quad_mesh({"first": tube, "second": tube.mirrored()}, 6)
    write_vtk(mesh, tmp_path / "tube.vtk")
    lines = (tmp_path / "tube.vtk").read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("POINTS"))
    count = int(lines[start].split()[1])
    points = np.array([[float(x) for x in line.split()] for line in lines[start + 1 : start + 1 + count]])
    np.testing.assert_allclose(points, mesh.points, atol=1e-11)
    assert lines[start + 1 + count] == f"POLYGONS {2 * 36} {2 * 36 * 5}"
    assert {"first", "second"} < set(lines)
    assert lines[-36:] == ["1"] * 36
    with pytest.raises(ValueError, match="resolution = 0 is not allowed"):
        quad_mesh({"first": tube}, 0)


@pytest.fixture
def run(tmp_path):
    """A run folder as the optimizer leaves it, with the parts that an export reads."""
    baseline = MOLD.baseline_parameters()
    values = {name: value.tolist() for name, value in vars(baseline).items() if value is not None}
    after = values | {"wing_area": 0.8 * values["wing_area"]}
    variables = [variable(name, value, after[name]) for name, value in values.items()]
    configuration = {"vehicle": VEHICLE.model_dump(), "mission": MISSION.model_dump()}
    (tmp_path / "configuration.json").write_text(json.dumps(configuration))
    (tmp_path / "result.json").write_text(json.dumps(result(variables)))
    return tmp_path


def test_a_stored_vehicle_is_the_one_that_was_run(run):
    assert stored_vehicle(run / "configuration.json") == VEHICLE


def test_a_result_gives_the_shape_before_and_after(run):
    geometry, shapes = stored_shapes(run / "result.json")
    mold = geometry.outer_mold_line
    spans = {name: 2.0 * float(mold.motion(shape)[9]) for name, shape in shapes.items()}
    assert spans["before"] == pytest.approx(math.sqrt(VEHICLE.wing.area * VEHICLE.wing.aspect_ratio), rel=1e-12)
    assert spans["after"] == pytest.approx(math.sqrt(0.8) * spans["before"], rel=1e-12)
    files = export_shape(run / "result.json", "stl", run / "shapes")
    assert [file.name for file in files] == ["before.stl", "after.stl"]
    before, after = (read_stl(file)["corners"][..., 1].max() for file in files)
    assert before > after


def test_figures_show_each_shape_and_both_over_each_other(run):
    files = export_shape(run / "result.json", "png", run / "figures")
    shapes = ["before.png", "after.png", "before_measures.png", "after_measures.png"]
    assert [file.name for file in files] == [*shapes, "comparison.png"]
    for file in files:
        picture = read_png(file)
        assert min(picture.shape[:2]) > 600
        assert picture[..., :3].std() > 0.01  # not blank


def test_measures_drawn_on_the_outer_mold_line_are_those_of_the_shape():
    geometry = Geometry(VEHICLE)
    asked = dataclasses.replace(MOLD.baseline_parameters(), wing_area=torch.tensor(16.0).double())
    figure = geometry_measures.plot(mold_data(geometry, asked))
    texts = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    span = math.sqrt(16.0 * VEHICLE.wing.aspect_ratio)
    for expected in (f"span {span:.2f}", "area 16.00 m²", "fuselage 9.144", "1.688", "1.557", "diameter 3.05"):
        assert expected in texts
    assert all(axes.get_aspect() == 1.0 for axes in figure.axes)


def test_camber_meshes_drawn_are_the_lattices_own_and_the_disks_have_the_rotors_radius():
    geometry = Geometry(VEHICLE)
    mold = mold_data(geometry, MOLD.baseline_parameters())
    torch.testing.assert_close(
        mold["wing_mesh"], geometry(MOLD.baseline_parameters()).wing_mesh, rtol=0.0, atol=0.5001e-3
    )
    for rotor in VEHICLE.rotors:
        rim = mold["disks"][rotor.name]
        radius = torch.linalg.vector_norm(rim[:-1] - rim[:-1].mean(0), dim=-1)
        torch.testing.assert_close(radius, torch.full_like(radius, rotor.radius), rtol=0.0, atol=1e-3)
    figure = outer_mold_line.plot(mold)
    assert all(axes.get_aspect() == 1.0 for axes in figure.axes)
    assert [len(axes.collections) for axes in figure.axes] == [5, 5, 5, 5], "facets, and two meshes on both sides"


def test_views_are_right_handed_and_lengths_true():
    for view in (TOP, FRONT, SIDE, OBLIQUE):
        axes = np.array([view.right, view.up, np.cross(view.right, view.up)])
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(axes) == pytest.approx(1.0)
    assert OBLIQUE.depth(np.array([-1.0, -1.0, 1.0])) > 0.0  # the eye is ahead, to port and above


def test_views_look_from_where_their_titles_say():
    """Axes: x aft, y starboard, z up. What is nearer to the eye has the larger depth; the page shows what the eye sees."""
    ahead, starboard, up = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    for view, eye in ((TOP, up), (FRONT, ahead), (SIDE, -starboard)):
        assert view.depth(eye) == pytest.approx(1.0)
    assert TOP.flat(starboard) == pytest.approx([1.0, 0.0])
    assert TOP.flat(ahead) == pytest.approx([0.0, 1.0])
    assert FRONT.flat(starboard) == pytest.approx([-1.0, 0.0])  # the left of who looks at the nose
    assert SIDE.flat(ahead) == pytest.approx([-1.0, 0.0])
    assert FRONT.flat(up) == pytest.approx([0.0, 1.0])
    assert SIDE.flat(up) == pytest.approx([0.0, 1.0])


def test_the_command_writes_the_baseline(tmp_path):
    done = CliRunner().invoke(main, ["export", "geometry", "--format", "vtk", "--output", str(tmp_path / "out")])
    assert done.exit_code == 0
    assert done.output.strip() == f"wrote {tmp_path / 'out' / 'baseline.vtk'}"
    assert (tmp_path / "out" / "baseline.vtk").stat().st_size > 1e5


def test_what_cannot_be_exported_is_refused(run):
    with pytest.raises(ConfigurationError, match="format = obj is not allowed"):
        export_shape(None, "obj", run)
    with pytest.raises(ConfigurationError, match="exists and is not a folder"):
        export_shape(None, "stl", run / "result.json")
    (run / "result.json").write_text(json.dumps(result([variable("x", 0.0, 1.0)])))
    with pytest.raises(ConfigurationError, match=r"result\.json: design variable wing_area is missing"):
        stored_shapes(run / "result.json")
    (run / "configuration.json").write_text(json.dumps({"vehicle": {"wing": {}}}))
    with pytest.raises(ConfigurationError, match=r"configuration\.json: vehicle\.[a-z.]* is missing"):
        stored_vehicle(run / "configuration.json")


@pytest.mark.parametrize("write", [write_stl, write_vtk])
def test_a_full_disk_leaves_no_half_a_mesh(tmp_path, monkeypatch, write):
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    (tmp_path / "wing").write_text("an earlier one")
    own = {name: SURFACES[name] for name in MOLD.components["wing"]}
    with pytest.raises(OSError, match="No space left"):
        write(quad_mesh(own, 4), tmp_path / "wing")
    assert {file.name: file.read_text() for file in tmp_path.iterdir()} == {"wing": "an earlier one"}
