"""Clearances of rotor disks: gaps to each other, to booms and edges, to the ground, as rows of a problem need them.

Gaps are negative where things cut each other and keep their slope there, so that a search finds its way out. Disks are flat and
filled: what passes through one cuts it. Blades that flap or bend need their own allowance in the limit of the row. Bodies are in
`elliptic_body`.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.implicit import find_root, with_implicit_gradient
from lpc_mdo.numerics.smooth import safe_norm

STEADY = 1e-6  # of the squared length of a segment: holds the closest of points that are all equally near to its middle
NEARLY_NOTHING = 1e-9  # m


@dataclass(frozen=True)
class Disk:
    """The disk that the tips of a rotor go around."""

    center: Tensor  # (..., 3) m
    axis: Tensor  # (..., 3) unit vector across the disk, of either sign
    radius: Tensor  # (...,) m


def disk_to_disk(one: Disk, other: Disk) -> Tensor:
    """Gap (...,) m between two disks along the line of their centers: no more than the true distance.

    Between planes across that line, one that touches each disk: exact where the disks lie in one plane or on one axis.
    """
    between = other.center - one.center
    distance = safe_norm(between, floor=NEARLY_NOTHING)
    along = between / distance[..., None]
    return distance - _reach(one, along) - _reach(other, along)


def disk_to_plane(disk: Disk, point: Tensor, normal: Tensor) -> Tensor:
    """Least height (...,) m of a disk above the plane through point (..., 3) m with unit normal (..., 3), exact."""
    return ((disk.center - point) * normal).sum(-1) - _reach(disk, normal)


def ground_normal(pitch: Tensor) -> Tensor:
    """Upward normal (..., 3) of level ground in geometry axes (x aft, z up) under an aircraft at pitch (...,) rad, nose up."""
    return torch.stack([-torch.sin(pitch), torch.zeros_like(pitch), torch.cos(pitch)], dim=-1)


def _reach(disk: Disk, direction: Tensor) -> Tensor:
    """How far (...,) m a disk reaches from its center along a unit direction (..., 3)."""
    axial = (direction * disk.axis).sum(-1)[..., None]
    return disk.radius * safe_norm(direction - axial * disk.axis, floor=NEARLY_NOTHING)


def disk_to_segment(disk: Disk, start: Tensor, end: Tensor, segment_radius: float | Tensor = 0.0) -> Tensor:
    """Gap (...,) m between a disk and the segment from start to end (..., 3) m, or a tube of radius (...,) m about it, exact.

    Where the segment's middle line pierces the disk: minus what it would have to move, in the disk's plane, to pass the rim, and
    minus the tube's radius.
    """
    start, along = start - disk.center, end - start
    heights = [(vector * disk.axis).sum(-1) for vector in (start, along)]
    flat = [vector - height[..., None] * disk.axis for vector, height in zip((start, along), heights, strict=True)]
    squares = [(flat[i] * flat[j]).sum(-1) for i, j in ((0, 0), (0, 1), (1, 1))]
    args = torch.broadcast_tensors(*heights, *squares, disk.radius)
    place = _closest(args)
    height, radial = _cylindrical(place, args)
    outside = (radial - disk.radius).clamp(min=0.0)
    distance = torch.sqrt(height**2 + outside**2 + NEARLY_NOTHING**2)
    # The crossing of the disk's plane, where there is one.
    is_crossing = heights[0] * (heights[0] + heights[1]) < 0.0
    crossing = torch.where(is_crossing, -heights[0] / torch.where(is_crossing, heights[1], 1.0), 0.0)
    inside = disk.radius - _cylindrical(crossing, args)[1]
    return torch.where(is_crossing & (inside > 0.0), -inside, distance) - segment_radius


def _cylindrical(place: Tensor, args: tuple[Tensor, ...]) -> tuple[Tensor, Tensor]:
    """Height above the disk and distance from its axis (...,) m at a fraction `place` (...,) of the segment."""
    height, rise, square, product, square_along, _ = args
    radial = square + place * (2.0 * product + place * square_along)
    return height + place * rise, torch.sqrt(radial.clamp(min=0.0) + NEARLY_NOTHING**2)


def _slope(place: Tensor, *args: Tensor) -> Tensor:
    """Half the slope of the squared distance to the disk along the segment (...,) m^2; past its ends it rises on."""
    _, rise, _, product, square_along, radius = args
    inside = place.clamp(0.0, 1.0)
    above, radial = _cylindrical(inside, args)
    outward = (1.0 - radius / radial).clamp(min=0.0) * (product + inside * square_along)
    length = rise**2 + square_along + NEARLY_NOTHING**2
    return above * rise + outward + length * (STEADY * (inside - 0.5) + place - inside)


def _closest(args: tuple[Tensor, ...]) -> Tensor:
    """Fraction (...,) of the segment nearest to the disk, between 0 and 1."""
    with torch.no_grad():
        zero = torch.zeros_like(args[0])
        length = args[1] ** 2 + args[4] + NEARLY_NOTHING**2
        first, last = (_slope(zero + end, *args).abs() / length for end in (0.0, 1.0))
        lower, upper = -1.0 - first, 2.0 + last
    root = find_root(_slope, lower, upper, args)
    return with_implicit_gradient(_slope, root, args).clamp(0.0, 1.0)
