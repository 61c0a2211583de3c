"""The full outer mold line: published sizes, closed bodies, volumes and areas against independent quadratures."""

import dataclasses
import math
from itertools import chain, pairwise

import numpy as np
import pytest
import torch
from scipy.integrate import quad
from scipy.interpolate import BSpline
from scipy.special import ellipe

from lpc_mdo.config import load
from lpc_mdo.geometry.bodies import disk_surface, tube_surface
from lpc_mdo.geometry.components import DISK_OFFSET
from lpc_mdo.geometry.lifting import fin_surface
from lpc_mdo.geometry.meshing import enclosed_volume, wetted_area
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.shape import Geometry

VEHICLE, _ = load()
MOLD = OuterMoldLine(VEHICLE)
BASELINE = MOLD.baseline_parameters()
NET = MOLD.control_points(BASELINE)
SURFACES = MOLD.surfaces(NET)
BODIES = [name for name in MOLD.components if not name.startswith("disk_")]
GRID = torch.linspace(0.0, 1.0, 21, dtype=torch.float64)


def real(values):
    return torch.tensor(values, dtype=torch.float64)


def deformed():
    return dataclasses.replace(
        BASELINE, wing_area=real(21.0), wing_aspect_ratio=real(10.5), wing_twist=real([0.1, 0.05, 0.0, -0.1, 0.15])
    )


# --- components


@pytest.mark.parametrize("thickness", [0.05, 0.124, 0.1265])
def test_the_fin_has_the_thickness_of_the_vehicle_file_to_the_last_digit(thickness):
    """Of a NACA four-digit section the ordinates are proportional to the thickness, and it is thickest at 30 % of the chord."""
    tenth = VEHICLE.vertical_tail.model_copy(update={"thickness_to_chord": 0.1})
    fin = tenth.model_copy(update={"thickness_to_chord": thickness})
    sides = [fin_surface(one)["starboard"].control_points[..., 1] for one in (fin, tenth)]
    torch.testing.assert_close(sides[0], 10.0 * thickness * sides[1], rtol=1e-12, atol=1e-12)
    u = torch.linspace(0.0, 1.0, 401, dtype=torch.float64)
    root = fin_surface(fin)["starboard"](u, torch.zeros_like(u))
    chord = float(root[:, 0].max() - root[:, 0].min())
    assert 2.0 * float(root[:, 1].abs().max()) / chord == pytest.approx(thickness, rel=2e-3)


def test_components_are_those_of_the_public_model():
    assert sum(name.startswith("boom_") for name in MOLD.components) == 8
    assert sum(name.startswith("hub_") for name in MOLD.components) == 9
    assert sum(name.startswith("disk_") for name in MOLD.components) == 9
    assert {"wing", "horizontal_tail", "vertical_tail", "fuselage"} < set(MOLD.components)
    assert sorted(chain.from_iterable(MOLD.components.values())) == sorted(SURFACES)


def test_as_built_and_undeformed_control_points_are_the_same():
    rest = torch.cat([patch.surface.control_points.flatten(0, 1) for patch in MOLD.patches.values()])
    torch.testing.assert_close(NET, rest, rtol=0, atol=1e-14)


def edges_of(surface):
    """The four edges (4, point, 3)."""
    (u0, u1), (v0, v1) = surface.domain
    u, v = u0 + (u1 - u0) * GRID, v0 + (v1 - v0) * GRID
    at = lambda a, b: surface(a.expand_as(GRID), b.expand_as(GRID))  # noqa: E731
    return torch.stack([at(real(u0), v), at(real(u1), v), at(u, real(v0)), at(u, real(v1))])


@pytest.mark.parametrize("parameters", [BASELINE, deformed()], ids=["baseline", "deformed"])
def test_every_edge_of_a_body_is_a_point_or_coincides_with_one_other_edge(parameters):
    surfaces = MOLD.surfaces(MOLD.control_points(parameters))
    for component in BODIES:
        edges = torch.cat([edges_of(surfaces[name]) for name in MOLD.components[component]])
        is_point = (edges - edges[:, :1]).abs().amax((-1, -2)) < 1e-12
        curves = edges[~is_point]
        forward = (curves[:, None] - curves).abs().amax((-1, -2))
        backward = (curves[:, None] - curves.flip(1)).abs().amax((-1, -2))
        partners = (torch.minimum(forward, backward) < 1e-12).sum(-1) - 1
        assert partners.tolist() == [1] * len(curves), component


@pytest.mark.parametrize("parameters", [BASELINE, deformed()], ids=["baseline", "deformed"])
def test_normals_point_out_of_closed_bodies(parameters):
    """The flux of any constant field out of a closed body vanishes; the volume is positive and knows no origin."""
    surfaces = MOLD.surfaces(MOLD.control_points(parameters))
    for component in BODIES:
        own = [surfaces[name] for name in MOLD.components[component]]
        volume = float(enclosed_volume(own))
        shifted = [dataclasses.replace(s, control_points=s.control_points + real([3.0, -5.0, 7.0])) for s in own]
        assert volume > 0.0
        assert float(enclosed_volume(shifted)) == pytest.approx(volume, rel=1e-9, abs=1e-9)


def test_port_and_starboard_are_mirror_images():
    mirror = real([1.0, -1.0, 1.0])
    for name, image in (("front_outer", "starboard"), ("rear_inner", "starboard")):
        for part in ("boom", "hub", "disk"):
            port, starboard = (SURFACES[f"{part}_{name}_{side}"] for side in ("port", image))
            assert float(wetted_area(port)) == pytest.approx(float(wetted_area(starboard)), rel=1e-12)
            low, high = (
                torch.stack([s.grid(GRID, GRID).flatten(0, 1).amin(0), s.grid(GRID, GRID).flatten(0, 1).amax(0)])
                for s in (port, starboard)
            )
            assert float(low[:, [0, 2]].sub(high[:, [0, 2]]).abs().max()) < 1e-12
            assert float((low * mirror)[:, 1].flip(0).sub(high[:, 1]).abs().max()) < 1e-12
    wing, image = SURFACES["wing_upper"], SURFACES["wing_upper_port"]
    torch.testing.assert_close(image.grid(1.0 - GRID, GRID), wing.grid(GRID, GRID) * mirror, rtol=0, atol=1e-13)


# --- fuselage


def fuselage_profile():
    """Half width, half height, axis height and station as SciPy splines of the parameter along the body."""
    surface = MOLD.patches["fuselage"].surface
    net, knots = surface.control_points.numpy(), surface.knots[0].numpy()
    rows = [net[:, 2, 1], 0.5 * (net[:, 0, 2] - net[:, 4, 2]), 0.5 * (net[:, 0, 2] + net[:, 4, 2]), net[:, 0, 0]]
    return [BSpline(knots, row, 3) for row in rows]


def test_fuselage_has_the_published_length_width_and_height():
    body = VEHICLE.fuselage
    grid = torch.linspace(0.0, 1.0, 161, dtype=torch.float64)  # 1/8 turns are on it
    points = SURFACES["fuselage"].grid(grid, grid)
    extent = points.flatten(0, 1).amax(0) - points.flatten(0, 1).amin(0)
    assert float(extent[0]) == pytest.approx(body.length, abs=1e-12)
    assert float(extent[1]) == pytest.approx(body.width, abs=1e-12)
    assert float((points[..., 2].amax(1) - points[..., 2].amin(1)).max()) == pytest.approx(body.height, abs=1e-12)
    torch.testing.assert_close(points[:, :, 1], -points.flip(1)[:, :, 1], rtol=0, atol=1e-14)


def test_fuselage_axis_meets_the_published_nose_and_rear_points():
    _, _, axis, station = fuselage_profile()
    u = np.linspace(0.0, 1.0, 20001)
    nose, rear = VEHICLE.fuselage.nose, VEHICLE.fuselage.rear
    assert (float(station(0.0)), float(axis(0.0))) == pytest.approx((nose[0], nose[2]), abs=1e-12)
    assert float(np.interp(rear[0], station(u), axis(u))) == pytest.approx(rear[2], abs=1e-9)


def test_fuselage_sections_are_ellipses():
    points = SURFACES["fuselage"].grid(GRID[3:-3], GRID).numpy()
    width, height, axis, station = (f(GRID[3:-3].numpy())[:, None] for f in fuselage_profile())
    np.testing.assert_allclose((points[..., 1] / width) ** 2 + ((points[..., 2] - axis) / height) ** 2, 1.0, atol=1e-12)
    np.testing.assert_allclose(points[..., 0], np.broadcast_to(station, points.shape[:2]), atol=1e-12)


def test_fuselage_volume_is_that_of_its_stacked_ellipses():
    width, height, _, station = fuselage_profile()
    slope = station.derivative()
    knots = np.unique(station.t)
    pieces = pairwise(knots)
    slices = sum(quad(lambda u: math.pi * width(u) * height(u) * slope(u), *piece, epsabs=1e-13)[0] for piece in pieces)
    assert float(enclosed_volume([SURFACES["fuselage"]])) == pytest.approx(slices, rel=1e-10)


def test_wing_rests_on_the_roof_of_the_cabin():
    cabin = SURFACES["fuselage"].control_points[3:7, :, 2]
    roof = float(cabin.max())
    root = SURFACES["wing_lower"].grid(GRID, real([0.0]))[:, 0]
    assert float(root[:, 2].min()) == pytest.approx(roof, abs=0.06)  # camber and incidence move it by centimetres
    assert roof == pytest.approx(MOLD.roof_height, abs=1e-12)


# --- wing, tubes, disks


def shoelace(points):
    x, z = points[:, 0], points[:, 2]
    return 0.5 * abs(np.dot(x, np.roll(z, -1)) - np.dot(z, np.roll(x, -1)))


@pytest.mark.parametrize("parameters", [BASELINE, deformed()], ids=["baseline", "deformed"])
def test_wing_volume_is_that_of_its_sections_along_the_span(parameters):
    """Sections stand in planes y = const: polygons of 4000 points, Simpson's rule along the span."""
    net = MOLD.control_points(parameters)
    surfaces = MOLD.surfaces(net)
    u, v = torch.linspace(0.0, 1.0, 2001, dtype=torch.float64), torch.linspace(0.0, 1.0, 41, dtype=torch.float64)
    upper, lower = (MOLD.patches[f"wing_{side}"].moved(net).grid(u, v).numpy() for side in ("upper", "lower"))
    areas = np.array([shoelace(np.concatenate([upper[:, j], lower[::-1, j]])) for j in range(len(v))])
    simpson = np.array([1.0] + [4.0, 2.0] * 19 + [4.0, 1.0]) / 120.0
    volume = 2.0 * upper[0, -1, 1] * simpson @ areas
    ours = float(enclosed_volume([surfaces[name] for name in MOLD.components["wing"]]))
    assert ours == pytest.approx(volume, rel=2e-6)  # the polygons miss 1e-6


def test_a_tube_is_round_and_smaller_than_its_cylinder():
    tube = tube_surface(real([0.0, 0.0, 0.0]), real([1.0, 2.0, 2.0]), 0.2)
    volume, area = float(enclosed_volume([tube])), float(wetted_area(tube))
    cylinder = math.pi * 0.2**2 * 3.0
    assert 0.9 * cylinder < volume < cylinder
    assert area < 2.0 * math.pi * 0.2 * (3.0 + 0.2)
    axis = real([1.0, 2.0, 2.0]) / 3.0
    middle = tube.grid(real([0.5]), GRID)[0]
    across = middle - (middle @ axis)[:, None] * axis
    torch.testing.assert_close(torch.linalg.vector_norm(across, dim=-1), real([0.2] * 21), rtol=0, atol=1e-14)


def test_disks_and_girths_have_their_closed_form():
    # A disk has pi r^2 exactly; the girth of the fuselage's cabin is a complete elliptic integral.
    disk = disk_surface(real([1.0, 2.0, 3.0]), 1.524, real([0.0, 1.0, 0.0]), real([1.0, 0.0, 0.0]))
    assert float(wetted_area(disk)) == pytest.approx(math.pi * 1.524**2, rel=1e-9)
    assert disk.normal(real([0.5]), real([0.3]))[0].tolist() == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    a, b = 0.5 * VEHICLE.fuselage.height, 0.5 * VEHICLE.fuselage.width
    width, height, _, _ = fuselage_profile()
    u = 0.4  # cabin
    assert (float(width(u)), float(height(u))) == pytest.approx((b, a), abs=1e-12)
    ring = SURFACES["fuselage"].grid(real([u]), torch.linspace(0.0, 1.0, 4001, dtype=torch.float64))[0]
    girth = float(torch.linalg.vector_norm(ring[1:] - ring[:-1], dim=-1).sum())
    assert girth == pytest.approx(4.0 * a * ellipe(1.0 - (b / a) ** 2), rel=1e-6)


def test_lift_disks_stand_above_their_booms():
    for rotor in VEHICLE.lift_rotors:
        boom, disk = SURFACES[f"boom_{rotor.name}"], SURFACES[f"disk_{rotor.name}"]
        foot = torch.linalg.vector_norm(disk.control_points[1, ::2] - disk.control_points[0, 0], dim=-1)
        torch.testing.assert_close(foot, torch.full((5,), rotor.radius, dtype=torch.float64), rtol=0, atol=1e-12)
        hub = disk.control_points[0, 0] - real([0.0, 0.0, DISK_OFFSET])
        torch.testing.assert_close(hub, real(rotor.hub), rtol=0, atol=1e-12)
        near = boom.grid(GRID, GRID).flatten(0, 1)
        near = near[(near[:, :2] - hub[:2]).norm(dim=-1) < 0.1]
        assert float(near[:, 2].max()) < float(disk.control_points[0, 0, 2])


def test_wetted_area_of_the_fuselage_is_what_the_drag_build_up_takes():
    points = SURFACES["fuselage"].grid(*(torch.linspace(0.0, 1.0, n, dtype=torch.float64) for n in (321, 289))).numpy()
    p, q, r, s = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    triangles = [np.linalg.norm(np.cross(b - a, c - a), axis=-1).sum() / 2 for a, b, c in ((p, q, r), (p, r, s))]
    assert float(Geometry(VEHICLE)(BASELINE).fuselage_wetted_area) == pytest.approx(sum(triangles), rel=2e-4)
