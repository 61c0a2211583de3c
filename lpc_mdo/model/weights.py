"""Masses of the aircraft by group, and the whole aircraft's mass properties."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines.mass_properties import MassProperties, combine
from lpc_mdo.disciplines.motor_sizing import Motor
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.model.design import Design
from lpc_mdo.model.structure_source import structural_calibration, structural_surrogate
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.surrogates.structural_mass import StructuralInputs, StructuralMassSurrogate

_BACKWARD = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)


@dataclass(frozen=True)
class WeightBreakdown:
    """Masses (...,) kg by group, and the whole aircraft's properties."""

    groups: dict[str, Tensor]
    total: MassProperties
    structural_inputs: StructuralInputs


class Weights:
    """Callable stage: design, shape, motors (..., rotor) and the speed (...,) m/s that the structure is sized for."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.structure: StructuralMassSurrogate = structural_surrogate(vehicle)
        self.structure_factor = structural_calibration(vehicle)
        self.fixed_mass = tensor([item.mass for item in vehicle.fixed_masses])
        self.fixed_position = tensor([item.position for item in vehicle.fixed_masses])
        self._fixed_inputs = {
            "fuselage_length": tensor(vehicle.fuselage.length),
            "vertical_tail_area": tensor(vehicle.vertical_tail.area),
        }
        # The regressions know no tail position: the horizontal tail's centre of gravity moves with its root.
        self._tail_share = tensor([[float(name == "horizontal_tail"), 0.0, 0.0] for name in self.structure.components])
        self._battery_line = tensor([0.0, *vehicle.battery.position[1:]])
        self._lift_count = len(vehicle.lift_rotors)

    def __call__(self, design: Design, shape: Shape, motors: Motor, speed: Tensor) -> WeightBreakdown:
        inputs = StructuralInputs(
            wing_area=shape.wing.area,
            wing_aspect_ratio=shape.wing.aspect_ratio,
            battery_mass=design.battery_mass,
            cruise_speed=speed,
            horizontal_tail_area=shape.tail.area,
            **self._fixed_inputs,
        )
        structure = self.structure.guarded(inputs, self.vehicle.structure.outside_samples)
        factor = self.structure_factor
        structure_mass = structure.mass * factor
        batch = structure_mass.shape[:-1]
        moved = design.tail_position - self.vehicle.horizontal_tail.root_quarter_chord[0]
        structure_position = structure.center_of_gravity + moved[..., None, None] * self._tail_share
        battery_position = design.battery_position[..., None, None] * _BACKWARD + self._battery_line
        mass = torch.cat(
            [structure_mass, motors.mass, design.battery_mass[..., None], self.fixed_mass.expand(*batch, -1)], dim=-1
        )
        position = torch.cat(
            [structure_position, shape.hubs, battery_position, self.fixed_position.expand(*batch, -1, -1)], dim=-2
        )
        points = mass.shape[-1] - structure_mass.shape[-1]
        own = torch.nn.functional.pad(structure.inertia * factor[:, None, None], (0, 0, 0, 0, 0, points))
        groups = dict(zip(structure.names, structure_mass.unbind(-1), strict=True))
        groups["lift_motors"] = motors.mass[..., : self._lift_count].sum(-1)
        groups["pusher_motor"] = motors.mass[..., self._lift_count :].sum(-1)
        groups["battery"] = design.battery_mass
        groups["fixed"] = self.fixed_mass.sum().expand(batch)
        return WeightBreakdown(groups, combine(mass, position, own), inputs)
