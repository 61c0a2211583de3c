"""Bodies with elliptical sections, as a fuselage: signed distances to points and rotor disks, and what fits inside.

The nearest point is sought on the line that the direction from the sections' centers draws along the skin: exact for bodies of
revolution. On the fuselage of the Lift+Cruise, a tenth higher than wide, distances are within 5 mm from 0.3 m inside outwards.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.clearance import Disk
from lpc_mdo.disciplines.inclined_rotor import plane_basis
from lpc_mdo.numerics.smooth import safe_sqrt, smooth_minimum

AZIMUTHS = 48  # points of a disk around each ring: with a radius of 1.5 m the nearest is at most 3 mm too far
RINGS = (1.0, 0.75, 0.5, 0.25)  # of the radius; the center beside them
WIDTH = 0.005  # m: over such differences points of a disk and corners of a box count together
SLIMMEST = 1e-3  # m: half axes of a section, so that its pole is one, too


@dataclass(frozen=True)
class EllipticBody:
    """Sections across x, from ahead to behind; each (..., section) m. Between them the body is straight."""

    station: Tensor  # x, increasing
    center_y: Tensor
    center_z: Tensor
    half_width: Tensor
    half_height: Tensor


def distance_to_body(body: EllipticBody, points: Tensor) -> Tensor:
    """Distance (..., point) m of points (..., point, 3) m from a body's skin, negative inside."""
    x, y, z = (coordinate[..., None] for coordinate in points.unbind(-1))
    station, center_y, center_z, half_width, half_height = (part[..., None, :] for part in vars(body).values())
    across, up = y - center_y, z - center_z
    share = safe_sqrt((across / (half_width + SLIMMEST)) ** 2 + (up / (half_height + SLIMMEST)) ** 2, 1e-16)
    beyond = 1.0 - 1.0 / share  # of the way from a section's center to the point, positive outside
    # From the point to the skin in its direction, section by section.
    ray = torch.stack(torch.broadcast_tensors(station - x, -beyond * across, -beyond * up), dim=-1)
    first, step = ray[..., :-1, :], ray.diff(dim=-2)
    place = (-(first * step).sum(-1) / (step**2).sum(-1)).clamp(0.0, 1.0)
    distance = safe_sqrt(((first + place[..., None] * step) ** 2).sum(-1), 1e-18).amin(-1)
    with torch.no_grad():
        ahead, behind = station[..., :-1], station[..., 1:]
        between = (x - ahead) / (behind - ahead)
        is_inside = torch.lerp(beyond[..., :-1], beyond[..., 1:], between.clamp(0.0, 1.0)) < 0.0
        sign = torch.where((is_inside & (between >= 0.0) & (between < 1.0)).any(-1), -1.0, 1.0)
    return sign * distance


def disk_to_body(disk: Disk, body: EllipticBody) -> Tensor:
    """Gap (...,) m between a filled disk and a body: the smooth minimum over the disk's points, within 3 mm of the least.

    Negative where the disk cuts the body, by how deep its deepest point lies.
    """
    first, second = plane_basis(disk.axis)
    angle = torch.arange(AZIMUTHS, dtype=disk.radius.dtype, device=disk.radius.device) * (2.0 * math.pi / AZIMUTHS)
    around = torch.cos(angle)[:, None] * first[..., None, :] + torch.sin(angle)[:, None] * second[..., None, :]
    rings = [share * disk.radius[..., None, None] * around for share in RINGS]
    offset = torch.cat([*rings, torch.zeros_like(around[..., :1, :])], dim=-2)
    return smooth_minimum(distance_to_body(body, disk.center[..., None, :] + offset), WIDTH)


def box_in_body(body: EllipticBody, center: Tensor, size: Tensor) -> Tensor:
    """Least depth (...,) m of a box along the axes inside a body, from center and size (..., 3) m; negative if it stands out.

    Of its corners: in a convex body all else lies deeper.
    """
    ends = torch.tensor([-0.5, 0.5], dtype=size.dtype, device=size.device)
    corners = center[..., None, :] + size[..., None, :] * torch.cartesian_prod(ends, ends, ends)
    return smooth_minimum(-distance_to_body(body, corners), WIDTH)
