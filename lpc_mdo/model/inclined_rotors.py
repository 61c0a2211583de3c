"""Rotors that the air does not meet along their axis, pushers at an angle of attack and lift rotors in flight on the wing: means over
a revolution in place of axial flow."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Rotor, RotorLoads
from lpc_mdo.disciplines.inclined_rotor import HubLoads, InclinedFlow, in_disk
from lpc_mdo.model.blade_airfoils import BladePolar

InclinedModel = Callable[[Rotor, InclinedFlow, BladePolar], HubLoads]
MEANS = ("thrust_per_length", "torque_per_length", "angle_of_attack")


def wind_direction(angle_of_attack: Tensor) -> Tensor:
    """Unit vector (..., 3) along the free stream in geometry axes, angle_of_attack (...,) rad."""
    return torch.stack(
        [torch.cos(angle_of_attack), torch.zeros_like(angle_of_attack), torch.sin(angle_of_attack)], dim=-1
    )


@dataclass(frozen=True)
class Turning:
    """How the air meets rotors (..., point), and how they turn."""

    velocity: Tensor  # (..., point, 3) m/s, the air's, geometry axes
    axis: Tensor  # (point, 3) unit vector along the thrust
    spin: Tensor  # (point,) +1 if right-handed about the axis


@dataclass(frozen=True)
class Inclination:
    """Points (k,) along `point` that the air does not meet along their axis, the model that holds there, and how many stations it takes
    as one."""

    points: Tensor
    model: InclinedModel
    grain: int = 1


def inclined(
    loads: RotorLoads, inclination: Inclination, turning: Turning, polars: Sequence[BladePolar]
) -> tuple[RotorLoads, Tensor, Tensor]:
    """Loads (..., point) that at the inclined points are means over a revolution; force and moment (..., point, 3) N and N m in the
    disks.

    loads: in axial flow; polars: one a point. The flow at the stations stays that of axial flow but for the angle of attack.
    """
    force = moment = loads.thrust.new_zeros(*loads.thrust.shape, 3)
    means = {name: getattr(loads, name) for name in MEANS}
    points, grain = inclination.points.tolist(), inclination.grain
    for polar in {id(polars[i]): polars[i] for i in points}.values():
        index = torch.tensor([i for i in points if polars[i] is polar])
        at, velocity = loads.at(index), turning.velocity[..., index, :]
        flow = InclinedFlow(
            velocity=velocity,
            axis=turning.axis[index].expand_as(velocity),
            spin=turning.spin[index].expand(velocity.shape[:-1]),
            rotation_speed=at.inflow.rotation_speed,
            density=at.inflow.density,
            speed_of_sound=at.inflow.speed_of_sound,
            dynamic_viscosity=at.inflow.dynamic_viscosity,
        )
        hub = inclination.model(_coarse(at.rotor, grain), flow, polar.coarse(grain))
        in_plane = in_disk(hub, flow)
        force, moment = force.index_copy(-2, index, in_plane[0]), moment.index_copy(-2, index, in_plane[1])
        of_stations = {name: getattr(hub, name).mean(-2).repeat_interleave(grain, -1) for name in MEANS}
        means = {name: value.index_copy(-2, index, of_stations[name]) for name, value in means.items()}
    return replace(loads, **means), force, moment


def _coarse(rotor: Rotor, grain: int) -> Rotor:
    """The blades with `grain` stations as one."""
    if grain == 1:
        return rotor
    chord, twist = (part.unflatten(-1, (-1, grain)).mean(-1) for part in (rotor.chord, rotor.twist))
    return replace(rotor, chord=chord, twist=twist)
