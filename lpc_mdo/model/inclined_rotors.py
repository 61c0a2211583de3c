"""Pushers at the aircraft's angle of attack: means over a revolution in place of axial flow."""

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, in_disk, inclined_rotor
from lpc_mdo.model.blade_airfoils import BladePolar

MEANS = ("thrust_per_length", "torque_per_length", "angle_of_attack")


def wind_direction(angle_of_attack: Tensor) -> Tensor:
    """Unit vector (..., 3) along the free stream in geometry axes, angle_of_attack (...,) rad."""
    return torch.stack(
        [torch.cos(angle_of_attack), torch.zeros_like(angle_of_attack), torch.sin(angle_of_attack)], dim=-1
    )


def inclined(
    loads: RotorLoads,
    points: Tensor,
    speed: Tensor,
    angle_of_attack: Tensor,
    spin: Tensor,
    polars: Sequence[BladePolar],
) -> tuple[RotorLoads, Tensor, Tensor]:
    """Loads (..., point) that at `points`, those of pushers, are means over a revolution in the stream; force and moment
    (..., point, 3) N and N m in the disks.

    loads: in axial flow; speed and angle_of_attack (..., point) m/s and rad; spin (point,) as in the vehicle file, +1
    right-handed about the rearward axis; polars: one a point. The flow at the stations stays that of axial flow but for the angle
    of attack.
    """
    force = moment = loads.thrust.new_zeros(*loads.thrust.shape, 3)
    means = {name: getattr(loads, name) for name in MEANS}
    for polar in {id(polars[i]): polars[i] for i in points}.values():
        index = torch.tensor([int(i) for i in points if polars[i] is polar])
        at = loads.at(index)
        velocity = wind_direction(angle_of_attack[..., index]) * speed[..., index, None]
        flow = InclinedFlow(
            velocity=velocity,
            axis=velocity.new_tensor([-1.0, 0.0, 0.0]).expand_as(velocity),
            spin=-spin[index].expand(velocity.shape[:-1]),
            rotation_speed=at.inflow.rotation_speed,
            density=at.inflow.density,
            speed_of_sound=at.inflow.speed_of_sound,
            dynamic_viscosity=at.inflow.dynamic_viscosity,
        )
        hub = inclined_rotor(at.rotor, flow, polar)
        in_plane = in_disk(hub, flow)
        force, moment = force.index_copy(-2, index, in_plane[0]), moment.index_copy(-2, index, in_plane[1])
        means = {name: value.index_copy(-2, index, getattr(hub, name).mean(-2)) for name, value in means.items()}
    return replace(loads, **means), force, moment
