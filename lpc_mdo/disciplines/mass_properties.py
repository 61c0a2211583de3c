"""Mass, centre of gravity and inertia of the whole aircraft from its components."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class MassProperties:
    """mass (...,) kg; center_of_gravity (..., 3) m in geometry axes; inertia (..., 3, 3) kg m^2 about it."""

    mass: Tensor
    center_of_gravity: Tensor
    inertia: Tensor


def point_inertia(mass: Tensor, arm: Tensor) -> Tensor:
    """Inertia (..., 3, 3) of `mass` (...,) at `arm` (..., 3) from the reference point."""
    squared = (arm**2).sum(-1)[..., None, None] * torch.eye(3, dtype=arm.dtype, device=arm.device)
    return mass[..., None, None] * (squared - arm[..., :, None] * arm[..., None, :])


def combine(mass: Tensor, position: Tensor, own_inertia: Tensor) -> MassProperties:
    """Sum over components by the parallel-axis theorem.

    mass (..., component) kg; position (..., component, 3) m; own_inertia (..., component, 3, 3) kg m^2 about each
    component's own centre of gravity (zero for a point mass).
    """
    total = mass.sum(-1)
    center = (mass[..., None] * position).sum(-2) / total[..., None]
    arm = position - center[..., None, :]
    inertia = (own_inertia + point_inertia(mass, arm)).sum(-3)
    return MassProperties(mass=total, center_of_gravity=center, inertia=inertia)
