"""Control deflections and rotor tilt: rigid rotations about axes that are taken from the geometry."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Axis:
    """A line: point (..., 3) m and unit direction (..., 3); positive turns follow the right hand."""

    point: Tensor
    direction: Tensor

    @classmethod
    def through(cls, start: Tensor, end: Tensor) -> "Axis":
        """The axis from `start` to `end`, each (..., 3) m. Raises ValueError if they coincide."""
        arm = end - start
        length = torch.linalg.vector_norm(arm, dim=-1, keepdim=True)
        if not bool((length > 0.0).all()):
            raise ValueError("start and end are not allowed; they must be two points")
        return cls(start, arm / length)

    @classmethod
    def lateral(cls, point: Tensor) -> "Axis":
        """The axis to starboard through `point` (..., 3): positive turns lower what is aft."""
        return cls(point, torch.tensor([0.0, 1.0, 0.0], dtype=point.dtype))


def rotate(points: Tensor, axis: Axis, angle: Tensor) -> Tensor:
    """Points (..., *grid, 3) turned by `angle` (...,) rad about an axis; leading dimensions broadcast.

    Source: Rodrigues (1840). The grid is what `points` has beyond the leading dimensions of the axis's point.
    """
    grid = points.dim() - axis.point.dim()
    spread = (..., *[None] * grid, slice(None))
    origin, direction = axis.point[spread], axis.direction.expand_as(axis.point)[spread]
    turn = angle[(..., *[None] * (grid + 1))]
    arm = points - origin
    along = (arm * direction).sum(-1, keepdim=True) * direction
    across = arm - along
    side = torch.linalg.cross(direction.expand_as(arm), arm)
    return origin + along + torch.cos(turn) * across + torch.sin(turn) * side


def rotate_vectors(vectors: Tensor, axis: Axis, angle: Tensor) -> Tensor:
    """Directions (..., 3), like a rotor's thrust, turned by `angle` (...,) rad about an axis."""
    still = Axis(torch.zeros_like(axis.point), axis.direction)
    return rotate(vectors, still, angle)
