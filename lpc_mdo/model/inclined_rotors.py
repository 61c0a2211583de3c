"""The pusher at the aircraft's angle of attack: means over a turn in place of axial flow, for climb and cruise."""

from dataclasses import replace

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Rotor, RotorLoads
from lpc_mdo.disciplines.blade_sections import Polar
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, in_disk, inclined_rotor


def wind_direction(angle_of_attack: Tensor) -> Tensor:
    """Unit vector (..., 3) along the free stream in geometry axes, angle_of_attack (...,) rad."""
    return torch.stack(
        [torch.cos(angle_of_attack), torch.zeros_like(angle_of_attack), torch.sin(angle_of_attack)], dim=-1
    )


def inclined_pusher(
    loads: RotorLoads, speed: Tensor, angle_of_attack: Tensor, spin: Tensor, polar: Polar
) -> tuple[RotorLoads, Tensor, Tensor]:
    """Loads (..., point) whose last points, the pusher's, are means over a turn in the stream; force (..., point, 3) N and
    moment (..., point, 3) N m in its disk.

    loads: in axial flow; speed and angle_of_attack (..., point) m/s and rad of the pusher's points; spin () as in the
    vehicle file, +1 right-handed about the rearward axis. The flow at the stations stays that of axial flow but for the angle
    of attack.
    """
    rotor, inflow, count = loads.rotor, loads.inflow, angle_of_attack.shape[-1]
    velocity = wind_direction(angle_of_attack) * speed[..., None]
    flow = InclinedFlow(
        velocity=velocity,
        axis=velocity.new_tensor([-1.0, 0.0, 0.0]).expand_as(velocity),
        spin=-spin.expand_as(angle_of_attack),
        rotation_speed=inflow.rotation_speed[..., -count:],
        density=inflow.density[..., -count:],
        speed_of_sound=inflow.speed_of_sound[..., -count:],
        dynamic_viscosity=inflow.dynamic_viscosity[..., -count:],
    )
    pusher = Rotor(
        rotor.radius[..., -count:],
        rotor.hub_radius[..., -count:],
        rotor.chord[..., -count:, :],
        rotor.twist[..., -count:, :],
        rotor.blades[..., -count:],
    )
    hub = inclined_rotor(pusher, flow, polar)
    means = {
        name: torch.cat([getattr(loads, name)[..., :-count, :], getattr(hub, name).mean(-2)], dim=-2)
        for name in ("thrust_per_length", "torque_per_length", "angle_of_attack")
    }
    return replace(loads, **means), *in_disk(hub, flow)
