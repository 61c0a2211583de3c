"""Meshes by projection, beams and boxes, rotor disks, packaging, actuation."""

import dataclasses
import math

import numpy as np
import pytest
import torch
from conftest import number

from lpc_mdo.airfoils.sections import section_ordinates
from lpc_mdo.config import load
from lpc_mdo.geometry.actuation import Axis, rotate, rotate_vectors
from lpc_mdo.geometry.bodies import elliptical_body
from lpc_mdo.geometry.components import DISK_OFFSET
from lpc_mdo.geometry.meshing import WingBoxMesh, camber_mesh, rotor_mesh
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.packaging import Box, battery_box, depth_inside, packaging_margin
from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.quadrature import gauss_legendre
from lpc_mdo.numerics.spacing import cosine_spacing, uniform_spacing

VEHICLE, _ = load(overrides=["vehicle.wing.airfoil=4417"])
MOLD = OuterMoldLine(VEHICLE)
BASELINE = MOLD.baseline_parameters()
NET = MOLD.control_points(BASELINE)
FUSELAGE = MOLD.patches["fuselage"].surface


def camber_line(x):
    """z/c of the wing's section."""
    return 0.5 * np.sum(section_ordinates(VEHICLE.wing.airfoil, np.clip(x, 0.0, 1.0)), axis=0)


def real(values):
    return torch.tensor(values, dtype=torch.float64)


def section_axes(points):
    """Points (n, 3) of a section of the wing in its own axes: chord fractions and ordinates over the chord."""
    chord = points[-1] - points[0]
    length = float(torch.linalg.vector_norm(chord))
    along = chord / length
    up = torch.linalg.cross(real([0.0, 1.0, 0.0]), along) * -1.0
    arm = points - points[0]
    return (arm @ along / length).numpy(), (arm @ up / length).numpy()


# --- camber meshes


@pytest.mark.parametrize(
    "chordwise", [uniform_spacing(6), cosine_spacing(9), real([0.0, 0.1, 0.35, 1.0])], ids=["uniform", "cosine", "free"]
)
def test_camber_mesh_has_the_spacing_asked_for_and_lies_on_the_camber_line(chordwise):
    spanwise = cosine_spacing(7)
    mesh = camber_mesh(MOLD, "wing", chordwise, spanwise)(NET)
    assert mesh.shape == (len(chordwise), 8, 3)
    half_span = float(MOLD.plans[0].half_span)
    torch.testing.assert_close(mesh[0, :, 1], half_span * spanwise, rtol=0, atol=1e-9)
    for j in range(8):
        x, z = section_axes(mesh[:, j])
        np.testing.assert_allclose(x, chordwise, atol=1e-8)
        np.testing.assert_allclose(z, camber_line(x), atol=2e-4)  # fit of the section


def test_camber_mesh_is_half_way_between_both_sides_after_any_deformation():
    """Both sides share the chordwise parameter, x/c = u^2: the mesh equals the mean of equal parameters."""
    chordwise, spanwise = uniform_spacing(5), uniform_spacing(4)
    array = camber_mesh(MOLD, "wing", chordwise, spanwise)
    for twist in (0.0, 0.15):
        asked = dataclasses.replace(BASELINE, wing_area=real(16.0), wing_twist=real([twist] * 5))
        net = MOLD.control_points(asked)
        sides = [
            MOLD.patches[f"wing_{side}"].moved(net).grid(torch.sqrt(chordwise), spanwise) for side in ("upper", "lower")
        ]
        torch.testing.assert_close(array(net), 0.5 * (sides[0] + sides[1]), rtol=0, atol=1e-8)


def test_fractions_out_of_order_are_refused():
    with pytest.raises(ValueError, match="chordwise is not allowed; its fractions must increase between 0 and 1"):
        camber_mesh(MOLD, "wing", real([0.0, 0.5, 0.4, 1.0]), uniform_spacing(2))
    with pytest.raises(ValueError, match="spanwise is not allowed"):
        camber_mesh(MOLD, "wing", uniform_spacing(2), real([0.0, 1.1]))


# --- beam and box


def test_box_has_the_thickness_of_the_section_at_its_spars():
    spars, spanwise = (0.2, 0.6), uniform_spacing(6)
    box = WingBoxMesh(MOLD, "wing", spars, spanwise)(NET)
    chord = MOLD.plans[0].chord[0] * (1.0 - (1.0 - VEHICLE.wing.taper) * spanwise)
    for height, spar in ((box.front_height, spars[0]), (box.rear_height, spars[1])):
        upper, lower = section_ordinates(VEHICLE.wing.airfoil, np.array([spar]))
        torch.testing.assert_close(height, chord * float(upper[0] - lower[0]), rtol=0, atol=2e-3)  # fit of the section
    # The width is laid along the camber line, longer than its part of the chord by the square of its slope.
    torch.testing.assert_close(box.width, 0.4 * chord, rtol=2e-3, atol=0)
    middle = 0.5 * float(chord[0]) * sum(camber_line(np.array(spars)))
    root = real(VEHICLE.wing.root_quarter_chord)
    incidence = VEHICLE.wing.incidence
    along, up = 0.15 * float(chord[0]), middle
    expected = root + real(
        [
            along * math.cos(incidence) + up * math.sin(incidence),
            0.0,
            up * math.cos(incidence) - along * math.sin(incidence),
        ]
    )
    torch.testing.assert_close(box.nodes[0], expected, rtol=0, atol=1e-3)


def test_box_grows_with_the_chord():
    mesh = WingBoxMesh(MOLD, "wing", (0.2, 0.6), uniform_spacing(4))
    larger = dataclasses.replace(BASELINE, wing_area=1.21 * BASELINE.wing_area)
    small, large = mesh(NET), mesh(MOLD.control_points(larger))
    for name in ("front_height", "rear_height", "width"):
        torch.testing.assert_close(getattr(large, name), 1.1 * getattr(small, name), rtol=1e-9, atol=0)


# --- rotors


@pytest.mark.parametrize("index", [0, 5, 8])
def test_rotor_meshes_are_even_circles_of_the_radius_asked_for(index):
    rotor = VEHICLE.rotors[index]
    asked = dataclasses.replace(BASELINE, rotor_radius=BASELINE.rotor_radius * 1.1)
    radial = real([0.2, 0.5, 1.0])
    points = rotor_mesh(MOLD, rotor.name, radial, 12)(MOLD.control_points(asked))
    lift = rotor.kind == "lift"
    center = real(rotor.hub) + (real([0.0, 0.0, DISK_OFFSET]) if lift else 0.0)
    arm = points - center
    size = torch.linalg.vector_norm(arm, dim=-1)
    torch.testing.assert_close(size, (1.1 * rotor.radius * radial)[:, None].expand(3, 12), rtol=1e-12, atol=0)
    assert float(arm[..., 2 if lift else 0].abs().max()) < 1e-14
    next_ = arm.roll(-1, 1)
    torch.testing.assert_close(
        (arm * next_).sum(-1) / size**2, torch.full((3, 12), math.cos(math.pi / 6)).double(), rtol=0, atol=1e-7
    )
    with pytest.raises(ValueError, match="azimuth = 3 is not allowed"):
        rotor_mesh(MOLD, rotor.name, radial, 3)


# --- packaging


def test_depth_in_a_round_body_is_the_radius_less_the_arm():
    x = torch.linspace(-5.0, 5.0, 8, dtype=torch.float64)
    center = torch.stack([x, 0 * x, 0 * x], dim=-1)
    tube = elliptical_body(center, 0 * x + 1.0, 0 * x + 1.0, real([0.0, 1.0, 0.0]), real([0.0, 0.0, 1.0]), 3)
    points = real([[0.0, 0.3, 0.4], [1.0, -0.9, 0.0], [0.5, 0.0, 1.5]]).requires_grad_()
    depth = depth_inside(tube, points)
    assert depth.tolist() == pytest.approx([0.5, 0.1, -0.5], abs=1e-9)
    (slope,) = torch.autograd.grad(depth.sum(), points)
    torch.testing.assert_close(slope, real([[0.0, -0.6, -0.8], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]), rtol=0, atol=1e-7)


def test_packaging_tells_which_battery_fits():
    """A block of 2000 kg/m^3 (ASSUMED): where the cabin's ellipse is wide enough it fits, at the keel it stands out."""
    x, y, z = VEHICLE.battery.position
    mass, box_at = number(VEHICLE.battery.mass), lambda height: real([x, y, height])
    fits = battery_box(mass, 2000.0, width=0.7, height=0.25, position=box_at(z + 0.15))
    assert float(fits.size.prod()) == pytest.approx(VEHICLE.battery.mass / 2000.0, rel=1e-12)
    margin = float(packaging_margin(FUSELAGE, fits))
    assert margin > 0.0
    # No further than the gap below its lower edges, from the section's ellipse.
    half_height, half_width = 0.5 * VEHICLE.fuselage.height, 0.5 * VEHICLE.fuselage.width
    depth = (MOLD.roof_height - half_height - (z + 0.15 - 0.125)) / half_height
    assert margin < half_width * math.sqrt(1.0 - depth**2) - 0.35
    for larger in (Box(box_at(z), fits.size), Box(fits.center, fits.size * real([1.0, 2.5, 1.0]))):
        assert float(packaging_margin(FUSELAGE, larger)) < 0.0
    with pytest.raises(ValueError, match="density = 0 is not allowed; it must be positive"):
        battery_box(mass, 0.0, 0.9, 0.25, box_at(z))


# --- actuation


def test_rotor_tilt_turns_thrust_and_disk_alike():
    rotor = VEHICLE.rotors[0]
    axis = Axis.lateral(real(rotor.hub))
    disk = rotor_mesh(MOLD, rotor.name, real([0.5, 1.0]), 8)(NET)
    angle = number(-0.3)  # forward
    turned = rotate(disk, axis, angle)
    thrust = rotate_vectors(real([0.0, 0.0, 1.0]), axis, angle)
    assert thrust.tolist() == pytest.approx([-math.sin(0.3), 0.0, math.cos(0.3)], abs=1e-15)
    plane = (turned - turned[0, 0]) @ thrust
    assert float(plane.abs().max()) < 1e-13
    torch.testing.assert_close((turned - axis.point).norm(dim=-1), (disk - axis.point).norm(dim=-1), rtol=1e-13, atol=0)


def test_axis_through_two_points_leaves_them_in_place_and_turns_the_right_hand_way():
    start, end = real([1.0, 2.0, 3.0]), real([2.0, 4.0, 5.0])
    axis = Axis.through(start, end)
    angles = real([0.4, -1.2])
    batch = Axis(axis.point.expand(2, 3), axis.direction.expand(2, 3))
    both = rotate(torch.stack([start, end]).expand(2, 2, 3), batch, angles)
    torch.testing.assert_close(both, torch.stack([start, end]).expand(2, 2, 3), rtol=0, atol=1e-14)
    z_axis = Axis.through(real([0.0, 0.0, 0.0]), real([0.0, 0.0, 2.0]))
    quarter = rotate(real([[1.0, 0.0, 5.0]]), z_axis, number(0.5 * math.pi))
    torch.testing.assert_close(quarter, real([[0.0, 1.0, 5.0]]), rtol=0, atol=1e-15)
    with pytest.raises(ValueError, match="they must be two points"):
        Axis.through(start, start)


def test_deflections_of_segments_are_batched_and_have_gradients():
    mesh = camber_mesh(MOLD, "horizontal_tail", uniform_spacing(2), uniform_spacing(3))(NET)
    hinge = Axis.lateral(real([8.6, 0.0, 2.4])[None].expand(3, 3))
    angles = real([0.1, 0.0, -0.2]).requires_grad_()
    turned = rotate(mesh.expand(3, *mesh.shape), hinge, angles)
    torch.testing.assert_close(turned[1], mesh, rtol=0, atol=1e-14)
    assert torch.autograd.gradcheck(lambda a: rotate(mesh.expand(3, *mesh.shape), hinge, a), (angles,))


# --- quadrature, mapped measures


def test_gauss_legendre_is_exact_for_its_degree():
    x, weight = gauss_legendre(real([0.0, 0.5, 2.0]), 3)
    for power in range(6):
        assert float((weight * x**power).sum()) == pytest.approx(2.0 ** (power + 1) / (power + 1), rel=1e-13)
    assert abs(float((weight * x**6).sum()) - 2.0**7 / 7.0) > 1e-4
    with pytest.raises(ValueError, match="count = 0 is not allowed"):
        gauss_legendre(real([0.0, 1.0]), 0)


def test_mapped_measures_are_those_of_the_points():
    patch = MOLD.patches["wing_upper"]
    u, v = uniform_spacing(3), uniform_spacing(4)
    first, second = patch.at(u, v, MOLD.size), MOLD.patches["wing_lower"].at(u, v, MOLD.size)
    nets = torch.stack([NET, 1.5 * NET])
    a, b = first(nets), second(nets)
    assert a.shape == (2, 4, 5, 3)
    torch.testing.assert_close(first.distance(second, nets), (a - b).norm(dim=-1), rtol=0, atol=2e-12)
    torch.testing.assert_close(first.midpoint(second)(nets), 0.5 * (a + b), rtol=0, atol=1e-14)
    torch.testing.assert_close(first.norm(nets), a.norm(dim=-1), rtol=1e-12, atol=0)
    area = first.area(nets)
    assert float(area[1]) == pytest.approx(2.25 * float(area[0]), rel=1e-9)
    flat = BSplineSurface.clamped(real([[[0, 0, 0], [0, 3, 0]], [[2, 0, 0], [2, 3, 0]]]), (1, 1))
    square = dataclasses.replace(patch, first=0, surface=flat).at(u, v, 4)
    assert float(square.area(flat.control_points.flatten(0, 1))) == pytest.approx(6.0, rel=1e-12)
    with pytest.raises(ValueError, match="an area needs a grid"):
        patch.points(u, u, MOLD.size).area(NET)
