"""Distances from bodies with elliptical sections: spheres, the fuselage's own surface, disks and boxes."""

import math

import pytest
import torch
from conftest import central_difference

from lpc_mdo.config import load
from lpc_mdo.disciplines.clearance import Disk
from lpc_mdo.disciplines.elliptic_body import EllipticBody, box_in_body, disk_to_body, distance_to_body
from lpc_mdo.geometry.bodies import fuselage_sections, fuselage_surface
from lpc_mdo.geometry.components import DISK_OFFSET, roof_height
from lpc_mdo.geometry.packaging import depth_inside
from lpc_mdo.numerics.tensors import tensor

VEHICLE, _ = load()
FUSELAGE = EllipticBody(*fuselage_sections(VEHICLE.fuselage, roof_height(VEHICLE)))


def sphere(radius=1.0, count=200):
    angle = torch.linspace(0.0, math.pi, count, dtype=torch.float64)
    zero, half = torch.zeros_like(angle), radius * torch.sin(angle)
    return EllipticBody(-radius * torch.cos(angle), zero, zero, half, half)


def level_disk(center, radius=1.524):
    return Disk(tensor(center), tensor([0.0, 0.0, 1.0]), tensor(radius))


def some_points(count=400):
    generator = torch.Generator().manual_seed(0)
    share = torch.rand(count, 3, generator=generator, dtype=torch.float64)
    return tensor([-0.5, -2.0, 0.0]) + share * tensor([11.0, 4.0, 4.0])


def test_distance_from_a_sphere():
    generator = torch.Generator().manual_seed(1)
    points = 2.0 * torch.randn(300, 3, generator=generator, dtype=torch.float64)
    true = torch.linalg.vector_norm(points, dim=-1) - 1.0
    # Sections a hundredth apart, and half axes a millimetre more than they are.
    torch.testing.assert_close(distance_to_body(sphere(), points), true, rtol=0.0, atol=1.5e-3)


def test_distance_from_the_fuselage_is_that_of_its_surface():
    points = some_points()
    depth = depth_inside(fuselage_surface(VEHICLE.fuselage, roof_height(VEHICLE)), points)
    near = depth < 0.3
    assert int(near.sum()) > 300
    torch.testing.assert_close(distance_to_body(FUSELAGE, points)[near], -depth[near], rtol=0.0, atol=5e-3)
    assert bool((distance_to_body(FUSELAGE, points)[~near] < -0.2).all())


def test_disk_beside_a_sphere_and_cutting_it():
    for y, gap in ((3.0, 0.476), (2.524, 0.0), (2.3, -0.224)):
        assert float(disk_to_body(level_disk([0.0, y, 0.0]), sphere())) == pytest.approx(gap, abs=4e-3)


def test_disk_right_above_a_body_is_as_far_as_its_middle():
    assert float(disk_to_body(level_disk([0.0, 0.3, 1.4]), sphere())) == pytest.approx(0.4, abs=0.02)


def test_inner_lift_rotors_near_the_fuselage_as_they_move_inward():
    """Both sides alike, and a shift inward takes nearly as much from the gap."""
    x, _, z = VEHICLE.lift_rotors[2].hub
    gaps = []
    for y in (2.58, 2.08, 1.78):
        port, starboard = (float(disk_to_body(level_disk([x, s * y, z + DISK_OFFSET]), FUSELAGE)) for s in (-1.0, 1.0))
        assert port == pytest.approx(starboard, abs=1e-3)
        gaps.append(port)
    assert gaps == pytest.approx([0.581, 0.194, 0.019], abs=2e-3)


def test_a_box_fits_as_deep_as_its_corners():
    cabin, size = tensor([3.2, 0.0, 1.6]), tensor([1.0, 0.8, 0.6])
    depth = float(box_in_body(FUSELAGE, cabin, size))
    shell = torch.cartesian_prod(*(torch.linspace(-0.5, 0.5, 9, dtype=torch.float64) for _ in range(3)))
    true = float(-distance_to_body(FUSELAGE, cabin + size * shell).max())
    assert depth == pytest.approx(true, abs=0.015)
    assert depth <= true
    assert float(box_in_body(FUSELAGE, cabin, tensor([1.0, 2.0, 0.6]))) < 0.0


def test_gradient_equals_central_differences():
    def gaps(x):
        disk = Disk(x[:3], torch.nn.functional.normalize(x[3:6], dim=0), x[6])
        return torch.stack([disk_to_body(disk, FUSELAGE), box_in_body(FUSELAGE, x[7:10], x[10:])])

    x = tensor([1.4, 2.1, 2.34, 0.1, 0.05, 1.0, 1.5, 3.2, 0.05, 1.5, 1.0, 0.8, 0.7])
    exact = torch.autograd.functional.jacobian(gaps, x)
    torch.testing.assert_close(exact, central_difference(gaps, x, 1e-5), rtol=1e-6, atol=1e-7)
