"""Stability derivatives of lifting surfaces: the exact Jacobian of the vortex lattice's coefficients."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.trim import geometry_to_body
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice

COEFFICIENTS = ("lift", "induced_drag", "side_force", "roll", "pitch", "yaw")
VARIABLES = ("angle_of_attack", "sideslip", "roll_rate", "pitch_rate", "yaw_rate")


@dataclass(frozen=True)
class Reference:
    """What makes the coefficients: wing area m^2, mean chord m and span m, each (...,), and the moments' point (..., 3) m."""

    area: Tensor
    chord: Tensor
    span: Tensor
    point: Tensor


@dataclass(frozen=True)
class StabilityDerivatives:
    """Coefficients and their slopes per radian, rates made p b/2V, q c/2V, r b/2V; moments about body axes, x forward.

    Lift and side force across the stream (side force to starboard), moments positive starboard wing down, nose up, nose to
    starboard.
    """

    value: Tensor  # (..., 6) in the order of COEFFICIENTS
    slope: Tensor  # (..., 6, 5) by VARIABLES

    def of(self, coefficient: str, variable: str) -> Tensor:
        """One slope (...,) by the names in COEFFICIENTS and VARIABLES. Raises ValueError for any other."""
        return self.slope[..., COEFFICIENTS.index(coefficient), VARIABLES.index(variable)]

    def static_margin(self) -> Tensor:
        """Distance (...,) from the moments' point back to the neutral point over the mean chord."""
        return -self.of("pitch", "angle_of_attack") / self.of("lift", "angle_of_attack")


def air_velocity(speed: Tensor, angle_of_attack: Tensor, sideslip: Tensor) -> Tensor:
    """The air's velocity (..., 3) m/s relative to the aircraft in geometry axes; sideslip positive for wind from starboard."""
    speed, alpha, beta = torch.broadcast_tensors(speed, angle_of_attack, sideslip)
    x, z = torch.cos(alpha) * torch.cos(beta), torch.sin(alpha) * torch.cos(beta)
    return speed[..., None] * torch.stack([x, -torch.sin(beta), z], dim=-1)


def lattice_coefficients(
    meshes: Sequence[Tensor], reference: Reference, state: Tensor, mach: Tensor | None = None
) -> Tensor:
    """Coefficients (..., 6) in the order of COEFFICIENTS at `state` (..., 5) in the order of VARIABLES (rad, rates scaled).

    Meshes of the whole aircraft, see `vortex_lattice`.
    """
    alpha, beta, p, q, r = state.unbind(-1)
    one = torch.ones_like(alpha)
    span, chord = 2.0 / reference.span, 2.0 / reference.chord
    turn = geometry_to_body(torch.stack([p * span, q * chord, r * span], dim=-1))  # the way back is the same half turn
    loads = vortex_lattice(
        meshes,
        air_velocity(one, alpha, beta),
        2.0 * one,
        reference.point,
        turn_rate=turn,
        mach=mach,
        has_chordwise_forces=True,
    )  # unit dynamic pressure
    force = torch.stack([loads.lift, loads.induced_drag, loads.side_force], dim=-1)
    arm = torch.stack(torch.broadcast_tensors(reference.span, reference.chord, reference.span), dim=-1)
    return torch.cat([force, geometry_to_body(loads.moment) / arm], dim=-1) / reference.area[..., None]


def stability_derivatives(
    meshes: Sequence[Tensor], reference: Reference, state: Tensor, mach: Tensor | None = None
) -> StabilityDerivatives:
    """Value and slopes at `state` (..., 5), as for `lattice_coefficients`; differentiable with respect to meshes and state.

    One factorization serves all six rows.
    """
    is_differentiable = torch.is_grad_enabled() and any(t.requires_grad for t in (*meshes, state))
    with torch.enable_grad():
        at = state if state.requires_grad else state.detach().requires_grad_()
        value = lattice_coefficients(meshes, reference, at, mach)
        rows = [
            torch.autograd.grad(part.sum(), at, retain_graph=True, create_graph=is_differentiable)[0]
            for part in value.unbind(-1)
        ]
    return StabilityDerivatives(value if is_differentiable else value.detach(), torch.stack(rows, dim=-2))
