"""Does it fit? Boxes inside closed bodies."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.geometry.projection import closest_point
from lpc_mdo.geometry.surfaces import BSplineSurface

SAMPLES = 7  # points along each edge direction of a box


@dataclass(frozen=True)
class Box:
    """A box along the axes: center (3,) and size (3,) in m."""

    center: Tensor
    size: Tensor

    def shell(self) -> Tensor:
        """Points (point, 3) all over the faces, corners included."""
        steps = torch.linspace(-0.5, 0.5, SAMPLES, dtype=torch.float64)
        grid = torch.cartesian_prod(steps, steps, steps)
        return self.center + self.size * grid[(grid.abs() == 0.5).any(-1)]


def battery_box(mass: Tensor, density: float, width: float, height: float, position: Tensor) -> Box:
    """The battery as a block of given width and height (m) and density (kg/m^3) about its centre of gravity (3,).

    Raises ValueError unless all are positive.
    """
    for name, value in (("mass", float(mass)), ("density", density), ("width", width), ("height", height)):
        if not value > 0.0:
            raise ValueError(f"{name} = {value:g} is not allowed; it must be positive")
    length = mass / (density * width * height)
    return Box(position, torch.stack([length, torch.full_like(length, width), torch.full_like(length, height)]))


def depth_inside(body: BSplineSurface, points: Tensor) -> Tensor:
    """How far points (point, 3) lie inside a closed body with du x dv outward, m; negative outside.

    Differentiable with respect to the points: the closest point moves along the surface, so the gradient is its normal.
    Raises ArithmeticError where no closest point was found.
    """
    found = closest_point(body, points.detach())
    if not bool(found.is_converged.all()):
        raise ArithmeticError(f"{int((~found.is_converged).sum())} points have no closest point on the body")
    gap = found.point - points
    sign = torch.sign((gap.detach() * body.normal(found.u, found.v)).sum(-1))
    return sign * torch.linalg.vector_norm(gap, dim=-1)


def packaging_margin(body: BSplineSurface, box: Box) -> Tensor:
    """Least distance () m from a box's faces to the skin around it; negative by how far the box stands out."""
    return depth_inside(body, box.shell()).min()
