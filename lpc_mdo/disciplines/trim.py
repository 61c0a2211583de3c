"""Equilibrium of forces and moments in steady flight, and the stall speed."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import GRAVITY

_HALF_TURN = torch.tensor([-1.0, 1.0, -1.0], dtype=torch.float64)


@dataclass(frozen=True)
class TrimResidual:
    """Net force (..., 3) N and moment about the centre of gravity (..., 3) N m.

    Body axes: x forward, y starboard, z down; moments roll, pitch, yaw, positive starboard wing down, nose up, nose
    to starboard.
    """

    force: Tensor
    moment: Tensor

    def scaled(self, weight: Tensor, length: Tensor) -> Tensor:
        """(..., 6): forces over `weight` (...,) N, moments over weight x `length` (...,) m."""
        scale = weight[..., None]
        return torch.cat([self.force / scale, self.moment / (scale * length[..., None])], dim=-1)


def geometry_to_body(vector: Tensor) -> Tensor:
    """Geometry axes (x aft, y starboard, z up) to body axes; forces, arms and moments alike, (..., 3).

    The turn is by 180 degrees about y, a proper rotation, hence axial vectors change as polar ones do.
    """
    return vector * _HALF_TURN.to(vector)


def gravity_force(mass: Tensor, pitch: Tensor, bank: Tensor | None = None) -> Tensor:
    """Weight (..., 3) N in body axes at `pitch` and `bank` (...,) rad, wings level without bank."""
    weight = mass * GRAVITY
    x, down = -weight * torch.sin(pitch), weight * torch.cos(pitch)
    y, z = (torch.zeros_like(down), down) if bank is None else (down * torch.sin(bank), down * torch.cos(bank))
    return torch.stack(torch.broadcast_tensors(x, y, z), dim=-1)


def trim_residual(
    forces: Tensor,
    points: Tensor,
    moments: Tensor,
    center_of_gravity: Tensor,
    mass: Tensor,
    pitch: Tensor,
    bank: Tensor | None = None,
) -> TrimResidual:
    """Sum of all loads in steady straight flight; `maneuver_residual` adds what turns and accelerations ask.

    forces (..., load, 3) N at points (..., load, 3) m, free moments (..., 3) N m and center_of_gravity (..., 3) m in
    geometry axes; mass (...,) kg; pitch and bank (...,) rad.
    """
    arms = points - center_of_gravity[..., None, :]
    moment = torch.linalg.cross(*torch.broadcast_tensors(arms, forces)).sum(-2) + moments
    return TrimResidual(
        force=geometry_to_body(forces.sum(-2)) + gravity_force(mass, pitch, bank), moment=geometry_to_body(moment)
    )


@dataclass(frozen=True)
class Maneuver:
    """Motion of the centre of gravity and about it in body axes, each (..., 3); all zero but velocity in a straight segment."""

    velocity: Tensor  # m/s
    turn_rate: Tensor  # rad/s
    acceleration: Tensor  # m/s^2, change of the velocity's components
    turn_acceleration: Tensor  # rad/s^2


def maneuver_residual(sum_of_loads: TrimResidual, mass: Tensor, inertia: Tensor, maneuver: Maneuver) -> TrimResidual:
    """What is left of the loads after the motion has taken its share, by Newton and Euler.

    mass (...,) kg; inertia (..., 3, 3) kg m^2 about the centre of gravity in body axes, off-diagonals negative products.
    Turns, pull-ups and transition have this residual zero where straight flight has the sum of loads zero.
    """
    turn = maneuver.turn_rate
    momentum = (inertia @ turn[..., None])[..., 0]
    force = maneuver.acceleration + torch.linalg.cross(*torch.broadcast_tensors(turn, maneuver.velocity))
    moment = (inertia @ maneuver.turn_acceleration[..., None])[..., 0]
    moment = moment + torch.linalg.cross(*torch.broadcast_tensors(turn, momentum))
    return TrimResidual(force=sum_of_loads.force - mass[..., None] * force, moment=sum_of_loads.moment - moment)


def stall_speed(mass: Tensor, density: Tensor, wing_area: Tensor, maximum_lift_coefficient: Tensor) -> Tensor:
    """Speed (...,) m/s at which maximum lift equals the weight."""
    return torch.sqrt(2.0 * mass * GRAVITY / (density * wing_area * maximum_lift_coefficient))
