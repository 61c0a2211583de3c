"""Sum of forces and moments in every segment: rotors, wing, tail, parasitic drag and weight."""

import torch
from torch import Tensor

from lpc_mdo.disciplines.mass_properties import MassProperties
from lpc_mdo.disciplines.trim import TrimResidual, trim_residual
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.model.aerodynamics import AerodynamicLoads
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.rotors import RotorOperation
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.numerics.tensors import tensor


class Trim:
    """Callable stage: residual (..., segment, 3)."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule = schedule
        rotors = [schedule.vehicle.rotors[i] for i in schedule.rotor]
        self.axis = tensor([rotor.axis for rotor in rotors])
        # Spin is right-handed about up for lift rotors, about the rearward axis for pushers; the aircraft feels the reaction.
        about = [(0.0, 0.0, 1.0) if rotor.kind == "lift" else (1.0, 0.0, 0.0) for rotor in rotors]
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
            forces = forces + rotors.disk_force[..., place, :]
            moments = moments + rotors.disk_moment[..., place, :]
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
        return trim_residual(
            forces=force[..., None, :],
            points=center[..., None, None, :],
            moments=moment,
            center_of_gravity=center[..., None, :],
            mass=total.mass[..., None],
            pitch=flight.pitch,
        )


def _moment(points: Tensor, forces: Tensor, center: Tensor) -> Tensor:
    found: Tensor = torch.linalg.cross(*torch.broadcast_tensors(points - center, forces))
    return found
