"""Mapped arrays: points on the geometry as constant linear maps of its control points."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class MappedArray:
    """Points that follow the control points: `matrix @ control_points`, reshaped.

    matrix (point, control point); shape: the grid that the points form. Sums, differences and multiples of
    mapped arrays are mapped arrays again, so a camber surface is half the sum of two sides.
    """

    matrix: Tensor
    shape: tuple[int, ...]

    def __call__(self, control_points: Tensor) -> Tensor:
        """Points (..., *shape, 3) in m from control points (..., control point, 3)."""
        points = self.matrix @ control_points
        return points.reshape(*control_points.shape[:-2], *self.shape, 3)

    def __add__(self, other: "MappedArray") -> "MappedArray":
        return MappedArray(self.matrix + other.matrix, self.shape)

    def __sub__(self, other: "MappedArray") -> "MappedArray":
        return MappedArray(self.matrix - other.matrix, self.shape)

    def __mul__(self, factor: float) -> "MappedArray":
        return MappedArray(self.matrix * factor, self.shape)

    __rmul__ = __mul__


def stack(arrays: list[MappedArray]) -> MappedArray:
    """One mapped array from several, points in a row."""
    matrix = torch.cat([array.matrix for array in arrays])
    return MappedArray(matrix, (matrix.shape[0],))
