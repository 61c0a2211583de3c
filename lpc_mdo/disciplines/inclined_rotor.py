"""Rotors in inclined and edgewise flow: quasi-steady blade loads averaged around the azimuth, forces and moments on the hub.

Two models of the induced velocity serve the same interface: annulus momentum at every azimuth, as in axial flow (Ning 2014;
here), which leaves the wind in the disk out of the mass flow and serves small inclinations; and the three-state inflow of Pitt
and Peters (`dynamic_inflow`), which holds up to edgewise flow. Flow along the blade is left out of the section loads.
"""

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Rotor, blades_of
from lpc_mdo.disciplines.blade_sections import Blades, Polar, section_flow

AZIMUTHS = 12


@dataclass(frozen=True)
class InclinedFlow:
    """Operating condition. Vectors in any right-handed axes fixed to the aircraft."""

    velocity: Tensor  # (..., 3) m/s, the air's relative to the hub
    axis: Tensor  # (..., 3) unit vector along the thrust
    spin: Tensor  # (...,) +1 if right-handed about the axis, -1 otherwise
    rotation_speed: Tensor  # (...,) rad/s, positive
    density: Tensor  # (...,) kg/m^3
    speed_of_sound: Tensor  # (...,) m/s
    dynamic_viscosity: Tensor  # (...,) Pa s

    @property
    def axial_velocity(self) -> Tensor:
        """(...,) m/s, positive from ahead of the disk."""
        return -(self.velocity * self.axis).sum(-1)

    @property
    def in_plane_speed(self) -> Tensor:
        """(...,) m/s."""
        in_plane = self.velocity + self.axial_velocity[..., None] * self.axis
        found: Tensor = torch.linalg.vector_norm(in_plane, dim=-1)
        return found


@dataclass(frozen=True)
class HubLoads:
    """Averages over a turn, of all blades together, on the aircraft at the hub."""

    force: Tensor  # (..., 3) N
    moment: Tensor  # (..., 3) N m
    thrust: Tensor  # (...,) N along the axis
    torque: Tensor  # (...,) N m that drives the rotor
    power: Tensor  # (...,) W
    thrust_per_length: Tensor  # (..., azimuth, station) N/m as if all blades were there
    torque_per_length: Tensor  # (..., azimuth, station) N, likewise
    angle_of_attack: Tensor  # (..., azimuth, station) rad


@dataclass(frozen=True)
class Turn:
    """Blade directions around the turn, (..., azimuth, 3), and the velocities that its sections meet."""

    outward: Tensor
    forward: Tensor
    axial: Tensor  # (..., azimuth, station) m/s without induction
    tangential: Tensor  # (..., azimuth, station) m/s


def plane_basis(axis: Tensor) -> tuple[Tensor, Tensor]:
    """Two unit vectors (..., 3) that make a right-handed system with the unit vector `axis` (..., 3), without singularity.

    Source: Duff et al., J. Computer Graphics Techniques 6 (2017).
    """
    x, y, z = axis.unbind(-1)
    sign = torch.where(z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = torch.stack([1.0 + sign * x * x * a, sign * b, -sign * x], dim=-1)
    return first, torch.stack([b, sign + y * y * a, -y], dim=-1)


def turn_of(radius: Tensor, flow: InclinedFlow, azimuths: int) -> Turn:
    """Equally spaced blade positions, for section radii (..., station) m. Raises ValueError unless azimuths >= 4."""
    if azimuths < 4:
        raise ValueError(f"azimuths = {azimuths} is not allowed; it must be at least 4")
    angle = torch.arange(azimuths, dtype=radius.dtype, device=radius.device) * (2.0 * math.pi / azimuths)
    first, second = (vector[..., None, :] for vector in plane_basis(flow.axis))
    cos, sin = torch.cos(angle)[:, None], torch.sin(angle)[:, None]
    spin = flow.spin[..., None, None]
    outward, forward = cos * first + sin * second, spin * (cos * second - sin * first)
    against = -(flow.velocity[..., None, :] * forward).sum(-1)
    tangential = (flow.rotation_speed[..., None] * radius)[..., None, :] + against[..., None]
    axial = flow.axial_velocity[..., None, None].expand_as(tangential)
    return Turn(outward, forward, axial, tangential)


def hub_loads(
    flow: InclinedFlow, turn: Turn, radius: Tensor, width: Tensor, thrust: Tensor, drag: Tensor, alpha: Tensor
) -> HubLoads:
    """Averages over the turn of section loads per length (..., azimuth, station) N/m along the axis and against the motion.

    radius (..., station) m, width (..., 1) m, alpha (..., azimuth, station) rad.
    """
    radius, width = radius[..., None, :], width[..., None]
    lift, arm_lift, pull, twist = (
        (part * width).sum(-1)[..., None] for part in (thrust, thrust * radius, drag, drag * radius)
    )
    axis = flow.axis[..., None, :].expand_as(turn.outward)
    force = (lift * axis - pull * turn.forward).mean(-2)
    torque = twist[..., 0].mean(-1)
    moment = (arm_lift * torch.linalg.cross(turn.outward, axis)).mean(-2)
    return HubLoads(
        force=force,
        moment=moment - (flow.spin * torque)[..., None] * flow.axis,
        thrust=lift[..., 0].mean(-1),
        torque=torque,
        power=torque * flow.rotation_speed,
        thrust_per_length=thrust,
        torque_per_length=drag * radius,
        angle_of_attack=alpha,
    )


def inclined_rotor(
    rotor: Rotor, flow: InclinedFlow, polar: Polar, *, has_hub_loss: bool = False, azimuths: int = AZIMUTHS
) -> HubLoads:
    """Hub loads with annulus momentum at every azimuth; in axial flow exactly those of `blade_element_momentum`.

    Leading dimensions broadcast. Raises ValueError as `blade_element_momentum` does and unless azimuths >= 4.
    """
    blades, width = blades_of(rotor)
    turn = turn_of(blades.radius, flow, azimuths)
    sections = section_flow(
        around(blades),
        turn.axial,
        turn.tangential,
        flow.density[..., None, None],
        flow.speed_of_sound[..., None, None],
        flow.dynamic_viscosity[..., None, None],
        polar,
        has_hub_loss=has_hub_loss,
    )
    return hub_loads(
        flow,
        turn,
        blades.radius,
        width,
        sections.thrust_per_length,
        sections.drag_per_length,
        sections.angle_of_attack,
    )


def in_disk(loads: HubLoads, flow: InclinedFlow) -> tuple[Tensor, Tensor]:
    """What inclination adds to thrust and torque: force (..., 3) N and moment (..., 3) N m in the plane of the disk."""
    force = loads.force - loads.thrust[..., None] * flow.axis
    return force, loads.moment + (flow.spin * loads.torque)[..., None] * flow.axis


def around(blades: Blades) -> Blades:
    """The same blades with an azimuth dimension before the stations."""
    return replace(blades, **{name: getattr(blades, name)[..., None, :] for name in vars(blades)})
