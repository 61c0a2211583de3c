"""B-spline patches: where their control points lie in the aircraft's list, and how points on them follow."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.geometry.mapped import MappedArray
from lpc_mdo.numerics.bsplines import basis_matrix


@dataclass(frozen=True)
class Patch:
    """A tensor-product B-spline surface (or, with one control point across, a curve or a point).

    first: index of its first control point among the aircraft's; shape (nu, nv), the v index running fastest;
    degrees (pu, pv); knots are clamped and uniform on [0, 1].
    """

    name: str
    first: int
    shape: tuple[int, int]
    degrees: tuple[int, int]

    @property
    def size(self) -> int:
        return self.shape[0] * self.shape[1]

    def at(self, u: Tensor, v: Tensor, total: int) -> MappedArray:
        """Points on the grid u (nu_points,) x v (nv_points,), parameters in [0, 1]."""
        basis_u = basis_matrix(u, self.shape[0], self.degrees[0])
        basis_v = basis_matrix(v, self.shape[1], self.degrees[1])
        matrix = torch.zeros(len(u) * len(v), total, dtype=torch.float64)
        matrix[:, self.first : self.first + self.size] = torch.kron(basis_u, basis_v)
        return MappedArray(matrix, (len(u), len(v)))
