"""B-spline surfaces of any degree and knots, and their place in the list of all control points of an aircraft."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.geometry.mapped import MappedArray
from lpc_mdo.numerics.bsplines import clamped_knots, local_bases


@dataclass(frozen=True)
class Jet:
    """Point and derivatives with respect to the parameters to second order, each (..., point, 3) in m."""

    point: Tensor
    u: Tensor
    v: Tensor
    uu: Tensor
    uv: Tensor
    vv: Tensor


@dataclass(frozen=True)
class BSplineSurface:
    """A tensor-product B-spline surface; rational if it has weights.

    control_points (..., nu, nv, 3) m, leading dimensions batch; degrees (pu, pv); knots (nu + pu + 1,) and
    (nv + pv + 1,), not decreasing; weights (nu, nv), positive. Raises ValueError where these do not fit together.
    """

    control_points: Tensor
    degrees: tuple[int, int]
    knots: tuple[Tensor, Tensor]
    weights: Tensor | None = None

    def __post_init__(self) -> None:
        for name, count, degree, knots in zip("uv", self.shape, self.degrees, self.knots, strict=True):
            if not count > degree >= 0:
                raise ValueError(f"degree {degree} in {name} is not allowed for {count} control points")
            if knots.shape != (count + degree + 1,):
                raise ValueError(f"{knots.numel()} knots in {name} are not allowed; it needs {count + degree + 1}")
            if not bool((knots[1:] >= knots[:-1]).all() & (knots[degree] < knots[count])):
                raise ValueError(f"knots in {name} are not allowed; they must not decrease and must span a range")
        if self.weights is not None and not (self.weights.shape == self.shape and bool((self.weights > 0).all())):
            raise ValueError(f"weights are not allowed; they must be positive and of shape {self.shape}")

    @classmethod
    def clamped(cls, control_points: Tensor, degrees: tuple[int, int]) -> "BSplineSurface":
        """The surface with clamped uniform knots on [0, 1]."""
        counts = control_points.shape[-3:-1]
        knots = [torch.from_numpy(clamped_knots(n, p)) for n, p in zip(counts, degrees, strict=True)]
        return cls(control_points, degrees, (knots[0], knots[1]))

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of control points (nu, nv)."""
        return (self.control_points.shape[-3], self.control_points.shape[-2])

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """First and last u, first and last v."""
        ends = [
            (float(knots[degree]), float(knots[count]))
            for knots, degree, count in zip(self.knots, self.degrees, self.shape, strict=True)
        ]
        return ends[0], ends[1]

    def __call__(self, u: Tensor, v: Tensor) -> Tensor:
        """Points (..., point, 3) in m at the parameters u, v, each (point,), in the domain."""
        return self._differentiated(u, v, 0)[0][0]

    def jet(self, u: Tensor, v: Tensor) -> Jet:
        """Points and derivatives to second order at the parameters u, v, each (point,), in the domain."""
        d = self._differentiated(u, v, 2)
        return Jet(d[0][0], d[1][0], d[0][1], d[2][0], d[1][1], d[0][2])

    def normal(self, u: Tensor, v: Tensor) -> Tensor:
        """Unit normals (..., point, 3) along du x dv; zero where the surface has no tangent plane."""
        d = self._differentiated(u, v, 1)
        return torch.nn.functional.normalize(torch.linalg.cross(d[1][0], d[0][1]), dim=-1)

    def grid(self, u: Tensor, v: Tensor) -> Tensor:
        """Points (..., nu_points, nv_points, 3) on the grid of the parameters u (nu_points,) and v (nv_points,)."""
        pairs = torch.cartesian_prod(u, v)
        return self(pairs[:, 0], pairs[:, 1]).unflatten(-2, (u.numel(), v.numel()))

    def basis(self, u: Tensor, v: Tensor, derivative: tuple[int, int] = (0, 0)) -> Tensor:
        """Sparse matrix (point, nu nv) that takes the control points to points, or to a derivative.

        Raises ValueError for the derivative of a rational surface, which is no product of two bases.
        """
        if self.weights is not None and derivative != (0, 0):
            raise ValueError(f"derivative = {derivative} is not allowed; a rational basis is given for points only")
        columns, (basis_u, basis_v) = self._local(u, v, max(derivative))
        values = (basis_u[:, derivative[0], :, None] * basis_v[:, derivative[1], None, :]).flatten(1)
        if self.weights is not None:
            values = values * self.weights.flatten()[columns]
            values = values / values.sum(-1, keepdim=True)
        rows = torch.arange(u.numel())[:, None].expand_as(columns)
        size = (u.numel(), self.shape[0] * self.shape[1])
        return _sparse(torch.stack([rows.flatten(), columns.flatten()]), values.flatten(), size)

    def mirrored(self) -> "BSplineSurface":
        """The image in the plane y = 0, its u reversed so that du x dv is the image of the normal."""
        mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
        return self.reversed(self.control_points * mirror)

    def reversed(self, control_points: Tensor | None = None) -> "BSplineSurface":
        """The surface, with other control points if they are given, with u running backwards: its normal turns over."""
        points = self.control_points if control_points is None else control_points
        knots = self.knots[0]
        weights = None if self.weights is None else self.weights.flip(0)
        backwards = knots[0] + knots[-1] - knots.flip(0)
        return BSplineSurface(points.flip(-3), self.degrees, (backwards, self.knots[1]), weights)

    def _local(self, u: Tensor, v: Tensor, order: int) -> tuple[Tensor, list[Tensor]]:
        """Flat indices (point, (pu + 1) (pv + 1)) of the acting control points; bases (point, order + 1, p + 1)."""
        firsts, bases = [], []
        for name, x, knots, degree, (low, high) in zip(
            "uv", (u, v), self.knots, self.degrees, self.domain, strict=True
        ):
            if not bool(((x >= low) & (x <= high)).all()):
                raise ValueError(f"{name} is not allowed; it must lie between {low:g} and {high:g}")
            first, values = local_bases(x, knots, degree, order)
            firsts.append(first[:, None] + torch.arange(degree + 1))
            bases.append(values)
        index = firsts[0][:, :, None] * self.shape[1] + firsts[1][:, None, :]
        return index.flatten(1), bases

    def _differentiated(self, u: Tensor, v: Tensor, order: int) -> list[list[Tensor]]:
        """Entry [i][j] is the derivative (..., point, 3), i times by u and j times by v, for i + j <= order <= 2."""
        orders = tuple(range(order + 1))
        index, (basis_u, basis_v) = self._local(u, v, order)
        points = self.control_points.flatten(-3, -2)
        if self.weights is not None:
            weights = self.weights.flatten()[:, None]
            points = torch.cat([points * weights, weights.expand(*points.shape[:-1], 1)], dim=-1)
        near = points[..., index, :]  # (..., point, acting, 3 or 4)
        size = (self.degrees[0] + 1, self.degrees[1] + 1, near.shape[-1])
        rows = (basis_u @ near.reshape(*near.shape[:-2], size[0], -1)).unflatten(-1, size[1:])
        columns = [basis_v[:, : order + 1 - i] @ rows[..., i, :, :] for i in orders]
        found = [[columns[i][..., j, :] for j in orders if i + j <= order] for i in orders]
        return found if self.weights is None else _quotient(found)


@dataclass(frozen=True)
class Patch:
    """A named surface whose control points are part of the aircraft's list, the v index running fastest.

    first: index of its first control point there; surface: as built, before any deformation; is_outward: whether
    du x dv leaves the body.
    """

    name: str
    first: int
    surface: BSplineSurface
    is_outward: bool = True

    @property
    def size(self) -> int:
        return self.surface.shape[0] * self.surface.shape[1]

    def points(self, u: Tensor, v: Tensor, total: int) -> MappedArray:
        """The points at the parameters u, v, each (point,); sparse, for `total` control points."""
        own = self.surface.basis(u, v)
        index = own.indices() + torch.tensor([[0], [self.first]])
        return MappedArray(_sparse(index, own.values(), (u.numel(), total)), (u.numel(),))

    def at(self, u: Tensor, v: Tensor, total: int) -> MappedArray:
        """The points on the grid u (nu_points,) x v (nv_points,)."""
        pairs = torch.cartesian_prod(u.double(), v.double()).reshape(-1, 2)
        return MappedArray(self.points(pairs[:, 0], pairs[:, 1], total).matrix, (u.numel(), v.numel()))

    def moved(self, control_points: Tensor) -> BSplineSurface:
        """The surface for all control points (..., control point, 3) of the aircraft."""
        own = control_points[..., self.first : self.first + self.size, :].unflatten(-2, self.surface.shape)
        return BSplineSurface(own, self.surface.degrees, self.surface.knots, self.surface.weights)


def _sparse(index: Tensor, values: Tensor, size: tuple[int, int]) -> Tensor:
    return torch.sparse_coo_tensor(index, values, size, check_invariants=True).coalesce()


def _quotient(found: list[list[Tensor]]) -> list[list[Tensor]]:
    """Derivatives of the projected surface from those of the homogeneous one, to second order.

    Source: Piegl and Tiller, The NURBS Book (1997), eq. 4.20.
    """
    a = [[item[..., :3] for item in row] for row in found]
    w = [[item[..., 3:] for item in row] for row in found]
    weight, order = w[0][0], len(found) - 1
    point = a[0][0] / weight
    d: list[list[Tensor]] = [[point], [], []][: order + 1]
    if order >= 1:
        d[0].append((a[0][1] - w[0][1] * point) / weight)
        d[1].append((a[1][0] - w[1][0] * point) / weight)
    if order == 2:
        d[0].append((a[0][2] - 2.0 * w[0][1] * d[0][1] - w[0][2] * point) / weight)
        d[1].append((a[1][1] - w[1][0] * d[0][1] - w[0][1] * d[1][0] - w[1][1] * point) / weight)
        d[2].append((a[2][0] - 2.0 * w[1][0] * d[1][0] - w[2][0] * point) / weight)
    return d
