"""Gaps of rotor disks against brute-force searches, closed forms, symmetry and differences."""

import math

import pytest
import torch
from conftest import central_difference

from lpc_mdo.disciplines.clearance import Disk, disk_to_disk, disk_to_plane, disk_to_segment, ground_normal
from lpc_mdo.numerics.tensors import tensor

UP, FORWARD = [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]


def disk(center, axis=UP, radius=1.5):
    axis = torch.nn.functional.normalize(tensor(axis), dim=-1)
    return Disk(tensor(center), axis, tensor(radius))


def filled(one, rings=60, azimuths=240):
    """Points (point, 3) all over a disk."""
    axis = one.axis
    first = torch.linalg.svd(axis[None])[2][1]
    second = torch.linalg.cross(axis, first)
    share, angle = torch.meshgrid(
        torch.linspace(0.0, 1.0, rings, dtype=torch.float64),
        2.0 * math.pi * torch.arange(azimuths, dtype=torch.float64) / azimuths,
        indexing="ij",
    )
    flat = torch.cos(angle)[..., None] * first + torch.sin(angle)[..., None] * second
    return (one.center + one.radius * share[..., None] * flat).reshape(-1, 3)


def random_disks(count, seed, spread=4.0):
    generator = torch.Generator().manual_seed(seed)
    for _ in range(count):
        numbers = torch.randn(7, generator=generator, dtype=torch.float64)
        yield disk((spread * numbers[:3]).tolist(), numbers[3:6].tolist(), 0.5 + float(numbers[6].abs()))


def test_gap_of_coplanar_disks_is_that_of_their_rims_and_negative_where_they_overlap():
    for apart, gap in ((3.5, 0.5), (3.0, 0.0), (2.4, -0.6)):
        found = disk_to_disk(disk([0.0, 0.0, 0.0]), disk([0.0, apart, 0.0]))
        assert float(found) == pytest.approx(gap, abs=1e-9)


def test_gap_of_coaxial_disks_is_their_height():
    assert float(disk_to_disk(disk([0.0, 0.0, 0.0]), disk([0.0, 0.0, 0.7], radius=1.0))) == pytest.approx(0.7, abs=1e-8)


def test_gap_of_two_disks_is_symmetric_and_never_more_than_the_distance():
    tight = 0
    for one, other in zip(random_disks(30, 1), random_disks(30, 2), strict=True):
        gap = float(disk_to_disk(one, other))
        assert gap == pytest.approx(float(disk_to_disk(other, one)), abs=1e-12)
        true = float(torch.cdist(filled(one, 30, 90), filled(other, 30, 90)).min())
        assert gap <= true + 1e-9
        tight += gap > 0.8 * true
    assert tight >= 15  # it is a useful bound, not only a safe one


def test_vertical_and_rearward_disks_meet_at_right_angles():
    """A pusher whose plane stands behind a lift rotor: the lift rotor's rear edge in its plane, at the height of its axis."""
    lift, pusher = disk([0.0, 0.0, 0.0]), disk([3.0, 0.0, 0.0], FORWARD, 1.0)
    assert float(disk_to_disk(lift, pusher)) == pytest.approx(1.5, abs=1e-8)


def test_height_above_the_ground_by_attitude():
    pusher = disk([10.0, 0.0, 2.4], FORWARD, 1.37)
    contact = tensor([4.4, 0.0, 0.0])
    assert float(disk_to_plane(pusher, contact, ground_normal(tensor(0.0)))) == pytest.approx(2.4 - 1.37, abs=1e-9)
    for pitch in (0.05, 0.15):
        height = float(disk_to_plane(pusher, contact, ground_normal(tensor(pitch))))
        lowest = (10.0 - 4.4) * -math.sin(pitch) + (2.4 - 1.37) * math.cos(pitch)
        assert height == pytest.approx(lowest, abs=1e-9)


def test_height_is_that_of_the_lowest_point_of_any_disk():
    for one in random_disks(10, 3):
        normal = torch.nn.functional.normalize(tensor([0.2, -0.3, 0.9]), dim=0)
        lowest = float((filled(one) @ normal).min())
        assert float(disk_to_plane(one, torch.zeros(3).double(), normal)) == pytest.approx(lowest, abs=2e-3)


def test_gap_to_a_segment_is_the_least_distance_of_all_points():
    count = 0
    generator = torch.Generator().manual_seed(4)
    for one in random_disks(60, 5, spread=2.0):
        start, end = 3.0 * torch.randn(2, 3, generator=generator, dtype=torch.float64)
        gap = float(disk_to_segment(one, start, end))
        share = torch.linspace(0.0, 1.0, 400, dtype=torch.float64)[:, None]
        true = float(torch.cdist(filled(one), start + share * (end - start)).min())
        if gap > 0.0:
            count += 1
            assert gap == pytest.approx(true, abs=0.01 + 1e-3 * true)  # the search is as coarse
            assert gap <= true + 1e-6
        else:
            assert true < 0.03
    assert count > 30


def test_a_segment_through_a_disk_tells_how_far_the_rim_is():
    one = disk([0.0, 0.0, 0.0])
    for y, gap in ((2.0, 0.5), (1.5, 0.0), (1.2, -0.3)):
        found = disk_to_segment(one, tensor([0.0, y, -1.0]), tensor([0.0, y, 1.0]))
        assert float(found) == pytest.approx(gap, abs=1e-8)
    beside = disk_to_segment(one, tensor([0.0, 2.0, -1.0]), tensor([0.0, 2.0, 1.0]), 0.15)
    assert float(beside) == pytest.approx(0.35, abs=1e-8)


def test_ends_of_a_segment_and_what_lies_flat_above():
    one = disk([0.0, 0.0, 0.0])
    assert float(disk_to_segment(one, tensor([0.0, 0.5, 0.4]), tensor([0.0, 0.5, 2.0]))) == pytest.approx(0.4, abs=1e-8)
    assert float(disk_to_segment(one, tensor([-1.0, 0.0, 0.3]), tensor([1.0, 0.0, 0.3]))) == pytest.approx(
        0.3, abs=1e-8
    )
    assert float(disk_to_segment(one, tensor([3.0, 0.0, 0.0]), tensor([3.0, 0.0, 0.0]))) == pytest.approx(1.5, abs=1e-8)


def test_mirrored_things_have_mirrored_gaps():
    mirror = tensor([1.0, -1.0, 1.0])
    one = disk([0.3, 2.0, 0.4], [0.1, 0.2, 1.0])
    image = Disk(one.center * mirror, one.axis * mirror, one.radius)
    start, end = tensor([-1.0, 4.0, 0.0]), tensor([3.0, 3.5, 0.9])
    there, here = disk_to_segment(one, start, end), disk_to_segment(image, start * mirror, end * mirror)
    assert float(there) == pytest.approx(float(here), abs=1e-10)


@pytest.mark.parametrize("height", [0.0, 0.5])  # the segment pierces the disk, or passes over its rim
def test_first_and_second_derivatives_equal_central_differences(height):
    def gap(x):
        axis = torch.nn.functional.normalize(x[3:6], dim=0)
        one = Disk(x[:3], axis, x[6])
        tilted = disk_to_segment(one, x[7:10], x[10:13])
        other = Disk(x[7:10], torch.nn.functional.normalize(x[10:13], dim=0), 0.8 * x[6])
        return torch.stack([tilted, disk_to_disk(one, other), disk_to_plane(one, x[7:10], axis.roll(1))])

    lies = [0.1, 1.1, -1.0 + height * 1.8, 0.2, 2.9, 1.0] if height else [0.1, 1.1, -1.0, 0.2, 1.2, 1.0]
    x = tensor([0.1, 0.2, 0.1, 0.1, -0.2, 1.0, 1.5, *lies])
    exact = torch.autograd.functional.jacobian(gap, x)
    torch.testing.assert_close(exact, central_difference(gap, x, 1e-3), rtol=1e-6, atol=1e-8)
    second = torch.autograd.functional.hessian(lambda y: gap(y).sum(), x)
    slope = lambda y: torch.autograd.functional.jacobian(gap, y).sum(0)  # noqa: E731
    torch.testing.assert_close(second, central_difference(slope, x, 1e-3), rtol=1e-5, atol=1e-6)
