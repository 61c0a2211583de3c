"""Sum of forces and moments in every segment: rotors, wing, tail, parasitic drag and weight."""

import torch
from torch import Tensor

from lpc_mdo.disciplines.mass_properties import MassProperties
from lpc_mdo.disciplines.trim import TrimResidual, trim_residual
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.model.aerodynamics import AerodynamicLoads
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.inclined_rotors import wind_direction
from lpc_mdo.model.rotors import RotorOperation
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.numerics.tensors import tensor


class Trim:
    """Callable stage: residual (..., segment, 3)."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        self.is_accelerated = any(s.acceleration != 0.0 or s.load_factor != 1.0 for s in schedule.segments)
        rotors = [schedule.vehicle.rotors[i] for i in schedule.rotor]
        self.axis = tensor([rotor.axis for rotor in rotors])
        # Spin is right-handed about up for lift rotors, about the rearward axis for pushers; the aircraft feels the reaction.
        about = [(0.0, 0.0, 1.0) if rotor.kind == "lift" else (1.0, 0.0, 0.0) for rotor in rotors]
        # What a twin's force and moment in its disk are on the other side, as polar and axial vectors mirror in the plane y = 0.
        is_image = [int(schedule.solved[place]) != k for k, place in enumerate(schedule.place)]
        self.polar = tensor([(1.0, -1.0, 1.0) if image else (1.0, 1.0, 1.0) for image in is_image])
        self.axial = tensor([(-1.0, 1.0, -1.0) if image else (1.0, 1.0, 1.0) for image in is_image])
        self.reaction = -tensor([rotor.spin for rotor in rotors])[:, None] * tensor(about)

    def __call__(
        self,
        shape: Shape,
        flight: FlightConditions,
        total: MassProperties,
        rotors: RotorOperation,
        aero: AerodynamicLoads | None = None,
    ) -> TrimResidual:
        """aero: None where no segment is flown on the wing."""
        schedule, center = self.schedule, total.center_of_gravity
        loads, place = rotors.solved_loads, schedule.place
        forces = loads.thrust[..., place, None] * self.axis
        moments = loads.torque[..., place, None] * self.reaction
        if rotors.disk_force is not None and rotors.disk_moment is not None:
            forces = forces + rotors.disk_force[..., place, :] * self.polar
            moments = moments + rotors.disk_moment[..., place, :] * self.axial
        moments = moments + _moment(shape.hubs[..., schedule.rotor, :], forces, center[..., None, :])
        force, moment = schedule.sums @ forces, schedule.sums @ moments
        if aero is not None:
            items = (aero.dynamic_pressure[..., None] * aero.parasitic_areas)[..., None] * aero.wind[..., None, :]
            arms = aero.parasitic_points[..., None, :, :], center[..., None, None, :]
            surfaces = _moment(shape.wing.aerodynamic_center[..., None, :], aero.lattice.force, center[..., None, :])
            force = force.index_add(-2, schedule.wingborne, aero.lattice.force + items.sum(-2))
            moment = moment.index_add(
                -2,
                schedule.wingborne,
                aero.lattice.moment + surfaces + _moment(arms[0], items, arms[1]).sum(-2),
            )
        if self.is_accelerated:
            force = force - total.mass[..., None, None] * self._acceleration(flight)
        return trim_residual(
            forces=force[..., None, :],
            points=center[..., None, None, :],
            moments=moment,
            center_of_gravity=center[..., None, :],
            mass=total.mass[..., None],
            pitch=flight.pitch,
        )

    def _acceleration(self, flight: FlightConditions) -> Tensor:
        """(..., segment, 3) m/s^2 in geometry axes: along the path, and normal to it what the load factor leaves beside weight."""
        wind = wind_direction(flight.angle_of_attack)
        normal = torch.stack([-wind[..., 2], torch.zeros_like(wind[..., 2]), wind[..., 0]], dim=-1)
        excess = GRAVITY * (flight.load_factor - 1.0)
        return excess[..., None] * normal - flight.acceleration[..., None] * wind


def _moment(points: Tensor, forces: Tensor, center: Tensor) -> Tensor:
    found: Tensor = torch.linalg.cross(*torch.broadcast_tensors(points - center, forces))
    return found
