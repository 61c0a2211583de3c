"""Rotors and propellers in axial flow by blade-element momentum theory; the sections are those of `blade_sections`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_sections import Blades, Polar, section_flow

TIP_MACH_LIMIT = 0.7


@dataclass(frozen=True)
class Rotor:
    """Blade geometry; leading dimensions batch, stations are the mid-points of equal intervals from hub to tip."""

    radius: Tensor  # (...,) m
    hub_radius: Tensor  # (...,) m
    chord: Tensor  # (..., station) m
    twist: Tensor  # (..., station) rad, from the plane of rotation
    blades: Tensor  # (...,)

    def at(self, index: Tensor) -> "Rotor":
        """The rotors at `index` of the last leading dimension."""
        per_station = ("chord", "twist")
        return Rotor(
            **{
                f.name: getattr(self, f.name).index_select(-2 if f.name in per_station else -1, index)
                for f in fields(self)
            }
        )


@dataclass(frozen=True)
class Inflow:
    """Operating condition, each (...,)."""

    axial_velocity: Tensor  # m/s, positive from ahead of the disk
    rotation_speed: Tensor  # rad/s, positive
    density: Tensor  # kg/m^3
    speed_of_sound: Tensor  # m/s
    dynamic_viscosity: Tensor  # Pa s

    def at(self, index: Tensor) -> "Inflow":
        """The conditions at `index` of the last dimension."""
        return Inflow(**{f.name: getattr(self, f.name).index_select(-1, index) for f in fields(self)})


@dataclass(frozen=True)
class RotorLoads:
    """Loads of all blades together and the flow at the stations."""

    rotor: Rotor
    inflow: Inflow
    station_radius: Tensor  # (..., station) m
    station_width: Tensor  # (..., 1) m
    thrust_per_length: Tensor  # (..., station) N/m
    torque_per_length: Tensor  # (..., station) N
    inflow_angle: Tensor  # (..., station) rad
    angle_of_attack: Tensor  # (..., station) rad
    lift_coefficient: Tensor  # (..., station)
    drag_coefficient: Tensor  # (..., station)
    reynolds: Tensor  # (..., station), of the geometric velocity
    mach: Tensor  # (..., station), likewise
    axial_induction: Tensor  # (..., station) m/s, added by the rotor to the axial velocity at the disk
    swirl: Tensor  # (..., station) m/s about the axis at the disk, with the rotor; twice that behind it
    residual: Tensor  # (..., station), of the inflow equation over the velocity

    def at(self, index: Tensor) -> "RotorLoads":
        """The loads at `index` of the last leading dimension."""

        values = {field.name: getattr(self, field.name) for field in fields(self)}
        taken = {name: v.index_select(-2, index) for name, v in values.items() if isinstance(v, Tensor)}
        return replace(self, rotor=self.rotor.at(index), inflow=self.inflow.at(index), **taken)

    @staticmethod
    def joined(parts: Sequence["RotorLoads"]) -> "RotorLoads":
        """Loads of several batches of rotors as one, in their order along the last leading dimension."""

        def joined(values: Sequence[Any], dim: int) -> Any:
            if isinstance(values[0], Tensor):
                return torch.cat(list(values), dim=dim)
            kind, per_station = type(values[0]), ("chord", "twist")
            return kind(
                **{
                    f.name: joined([getattr(value, f.name) for value in values], -2 if f.name in per_station else -1)
                    for f in fields(kind)
                }
            )

        return RotorLoads(**{f.name: joined([getattr(part, f.name) for part in parts], -2) for f in fields(RotorLoads)})

    @property
    def thrust(self) -> Tensor:
        """(...,) N."""
        return (self.thrust_per_length * self.station_width).sum(-1)

    @property
    def torque(self) -> Tensor:
        """(...,) N m."""
        return (self.torque_per_length * self.station_width).sum(-1)

    @property
    def power(self) -> Tensor:
        """Shaft power (...,) W."""
        return self.torque * self.inflow.rotation_speed

    @property
    def disk_area(self) -> Tensor:
        return math.pi * self.rotor.radius**2

    @property
    def blade_area(self) -> Tensor:
        """(...,) m^2, all blades."""
        return self.rotor.blades * (self.rotor.chord * self.station_width).sum(-1)

    @property
    def figure_of_merit(self) -> Tensor:
        """Ideal over actual power of a hovering rotor, T^1.5/(P sqrt(2 rho A)); zero where thrust is negative.

        Only `is_propelling` bounds it by one.
        """
        ideal = self.thrust.clamp(min=0.0) ** 1.5 / torch.sqrt(2.0 * self.inflow.density * self.disk_area)
        return ideal / self.power

    @property
    def propulsive_efficiency(self) -> Tensor:
        """T V/P (...,); only `is_propelling` bounds it by one."""
        return self.thrust * self.inflow.axial_velocity / self.power

    @property
    def advance_ratio(self) -> Tensor:
        """V/(n D) (...,), propeller convention."""
        return math.pi * self.inflow.axial_velocity / (self.inflow.rotation_speed * self.rotor.radius)

    @property
    def thrust_coefficient(self) -> Tensor:
        """T/(rho n^2 D^4) (...,), propeller convention."""
        n, diameter = self.inflow.rotation_speed / (2.0 * math.pi), 2.0 * self.rotor.radius
        return self.thrust / (self.inflow.density * n**2 * diameter**4)

    @property
    def torque_coefficient(self) -> Tensor:
        """Q/(rho n^2 D^5) (...,), propeller convention."""
        n, diameter = self.inflow.rotation_speed / (2.0 * math.pi), 2.0 * self.rotor.radius
        return self.torque / (self.inflow.density * n**2 * diameter**5)

    @property
    def is_vortex_ring(self) -> Tensor:
        """(...,) descent at 0.2 to 2 times the hover induced velocity, where momentum theory does not hold."""
        hover_velocity = torch.sqrt(self.thrust.clamp(min=0.0) / (2.0 * self.inflow.density * self.disk_area))
        descent = -self.inflow.axial_velocity
        return (descent > 0.2 * hover_velocity) & (descent < 2.0 * hover_velocity)

    @property
    def is_propelling(self) -> Tensor:
        """(...,) takes power and gives thrust, without descent: what figure of merit and efficiency are defined for."""
        return (self.torque > 0.0) & (self.thrust > 0.0) & (self.inflow.axial_velocity >= 0.0)

    @property
    def tip_mach(self) -> Tensor:
        """(...,) of the geometric velocity at the tip."""
        tip = torch.hypot(self.inflow.rotation_speed * self.rotor.radius, self.inflow.axial_velocity)
        return tip / self.inflow.speed_of_sound

    @property
    def is_tip_fast(self) -> Tensor:
        """(...,) the tip exceeds TIP_MACH_LIMIT, beyond which polars of moderate Mach numbers do not serve."""
        return self.tip_mach > TIP_MACH_LIMIT

    def stall_fraction(self, lower: float, upper: float) -> Tensor:
        """Share (...,) of the blade's span at angles of attack outside [lower, upper] rad."""
        is_stalled = (self.angle_of_attack < lower) | (self.angle_of_attack > upper)
        return is_stalled.to(self.thrust_per_length.dtype).mean(-1)

    @property
    def is_windmilling(self) -> Tensor:
        """(...,) the air drives the rotor."""
        return self.torque < 0.0


def station_radii(radius: Tensor, hub_radius: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Mid-points (..., count) and width (..., 1) of equal intervals from hub to tip, m."""
    fraction = (torch.arange(count, dtype=radius.dtype, device=radius.device) + 0.5) / count
    span = (radius - hub_radius)[..., None]
    return hub_radius[..., None] + span * fraction, span / count


def blades_of(rotor: Rotor) -> tuple[Blades, Tensor]:
    """A rotor's sections, and their width (..., 1) m.

    Raises ValueError if a radius does not exceed its hub radius, or a hub radius, a chord or a number of blades is not positive.
    """
    if bool(((rotor.radius <= rotor.hub_radius) | (rotor.hub_radius <= 0.0)).any()):
        raise ValueError("rotor.radius is not allowed; every radius must exceed its hub_radius, which must be positive")
    for name, value in (("chord", rotor.chord), ("blades", rotor.blades)):
        if bool((value <= 0.0).any()):
            raise ValueError(
                f"rotor.{name} = {float(value.detach().min()):g} is invalid: it must be above 0 everywhere"
            )
    r, width = station_radii(rotor.radius, rotor.hub_radius, rotor.chord.shape[-1])
    blades, tip, hub = (value[..., None] for value in (rotor.blades, rotor.radius, rotor.hub_radius))
    return Blades(blades, tip, hub, r, rotor.chord, rotor.twist), width


def blade_element_momentum(rotor: Rotor, inflow: Inflow, polar: Polar, *, has_hub_loss: bool = False) -> RotorLoads:
    """Loads on rotors in axial flow, every leading dimension in one batch.

    Raises ValueError as `blades_of`, and if density, speed of sound or viscosity is not positive.
    """
    for name in ("density", "speed_of_sound", "dynamic_viscosity"):
        if bool(((value := getattr(inflow, name)) <= 0.0).any()):
            raise ValueError(f"inflow.{name} = {float(value.detach().min()):g} is invalid: it must be above 0")
    blades, width = blades_of(rotor)
    axial, tangential = torch.broadcast_tensors(
        inflow.axial_velocity[..., None], inflow.rotation_speed[..., None] * blades.radius
    )
    flow = section_flow(
        blades,
        axial,
        tangential,
        inflow.density[..., None],
        inflow.speed_of_sound[..., None],
        inflow.dynamic_viscosity[..., None],
        polar,
        has_hub_loss=has_hub_loss,
    )
    return RotorLoads(
        rotor=rotor,
        inflow=inflow,
        station_radius=blades.radius,
        station_width=width,
        thrust_per_length=flow.thrust_per_length,
        torque_per_length=flow.drag_per_length * blades.radius,
        inflow_angle=flow.inflow_angle,
        angle_of_attack=flow.angle_of_attack,
        lift_coefficient=flow.lift_coefficient,
        drag_coefficient=flow.drag_coefficient,
        reynolds=flow.reynolds,
        mach=flow.mach,
        axial_induction=flow.axial_induction,
        swirl=flow.swirl,
        residual=flow.residual,
    )
