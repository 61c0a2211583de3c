"""Mapped arrays: points on the geometry as constant linear maps of its control points, and smooth measures of them."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.smooth import safe_norm


@dataclass(frozen=True)
class MappedArray:
    """Points that follow the control points: `matrix @ control_points`, reshaped.

    matrix (point, control point), sparse or dense; shape: the grid that the points form. Sums, differences and
    multiples of mapped arrays are mapped arrays again, so a camber surface is half the sum of two sides.
    """

    matrix: Tensor
    shape: tuple[int, ...]

    def __call__(self, control_points: Tensor) -> Tensor:
        """Points (..., *shape, 3) in m from control points (..., control point, 3)."""
        batch = control_points.shape[:-2]
        if self.matrix.is_sparse:  # sparse times dense knows no batch: the designs go side by side
            columns = control_points.movedim(-2, 0).flatten(1)
            points = torch.sparse.mm(self.matrix, columns).unflatten(1, (*batch, 3)).movedim(0, -2)
        else:
            points = self.matrix @ control_points
        return points.reshape(*batch, *self.shape, 3)

    def __add__(self, other: "MappedArray") -> "MappedArray":
        return MappedArray(self.matrix + other.matrix, self.shape)

    def __sub__(self, other: "MappedArray") -> "MappedArray":
        return MappedArray(self.matrix - other.matrix, self.shape)

    def __mul__(self, factor: float) -> "MappedArray":
        return MappedArray(self.matrix * factor, self.shape)

    __rmul__ = __mul__

    def midpoint(self, other: "MappedArray") -> "MappedArray":
        """Half way between two arrays of the same shape."""
        return 0.5 * (self + other)

    def norm(self, control_points: Tensor) -> Tensor:
        """Lengths (..., *shape) in m of the vectors, with a zero gradient at zero."""
        return safe_norm(self(control_points))

    def distance(self, other: "MappedArray", control_points: Tensor) -> Tensor:
        """Distances (..., *shape) in m between two arrays of the same shape."""
        return (self - other).norm(control_points)

    def area(self, control_points: Tensor) -> Tensor:
        """Area (...,) in m^2 of a grid (u, v): half the cross product of each cell's diagonals.

        Raises ValueError unless the points form a grid.
        """
        if len(self.shape) != 2:
            raise ValueError(f"shape = {self.shape} is not allowed; an area needs a grid (u, v)")
        points = self(control_points)
        first = points[..., 1:, 1:, :] - points[..., :-1, :-1, :]
        second = points[..., 1:, :-1, :] - points[..., :-1, 1:, :]
        return 0.5 * safe_norm(torch.linalg.cross(first, second)).sum((-1, -2))


def stack(arrays: list[MappedArray]) -> MappedArray:
    """One mapped array from several, points in a row."""
    matrix = torch.cat([array.matrix for array in arrays])
    return MappedArray(matrix, (matrix.shape[0],))
