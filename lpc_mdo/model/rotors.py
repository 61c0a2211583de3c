"""Rotors at all their operating points, in one batch."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads
from lpc_mdo.disciplines.dynamic_inflow import dynamic_inflow_rotor
from lpc_mdo.disciplines.inclined_rotor import inclined_rotor
from lpc_mdo.model.blade_airfoils import BladePolar, blade_polars, rotor_loads
from lpc_mdo.model.design import Design
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.inclined_rotors import Inclination, Turning, inclined, wind_direction
from lpc_mdo.model.schedule import Schedule, speed_name
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree
from lpc_mdo.numerics.tensors import tensor

BLADE_STATIONS = 28
# Of lift rotors in flight on the wing: thrust and torque within 1e-3 of those with 48 azimuths and all stations.
EDGEWISE = partial(dynamic_inflow_rotor, azimuths=8)
EDGEWISE_GRAIN = 2


@dataclass(frozen=True)
class RotorOperation:
    """Loads of the solved points (..., solved), which serve every point of the schedule.

    disk_force and disk_moment (..., solved, 3) N and N m in geometry axes, in the plane of the disk; None: the inflow is axial.
    """

    schedule: Schedule
    solved_loads: RotorLoads
    solved_polars: tuple[BladePolar, ...]
    disk_force: Tensor | None
    disk_moment: Tensor | None

    @cached_property
    def loads(self) -> RotorLoads:
        """(..., point)."""
        return self.solved_loads.at(self.schedule.place)

    @property
    def polars(self) -> tuple[BladePolar, ...]:
        """One a point."""
        return tuple(self.solved_polars[i] for i in self.schedule.place)

    @property
    def efficiency(self) -> Tensor:
        """(..., point) figure of merit of lift rotors, propulsive efficiency of pushers."""
        solved, is_propelling = self.solved_loads, self.schedule.is_propelling[self.schedule.solved]
        value = torch.where(is_propelling, solved.propulsive_efficiency, solved.figure_of_merit)
        return value[..., self.schedule.place]


class Rotors:
    """Callable stage: design and flight conditions -> RotorOperation. `polars`: one a rotor; default: the vehicle file's."""

    def __init__(self, schedule: Schedule, polars: Sequence[BladePolar] | None = None) -> None:
        self.schedule, vehicle = schedule, schedule.vehicle
        self.radial = (torch.arange(BLADE_STATIONS, dtype=torch.float64) + 0.5) / BLADE_STATIONS
        self.polars = tuple(polars or blade_polars(vehicle, self.radial))
        self.blades = tensor([rotor.blades for rotor in vehicle.rotors])
        self.root_cutout = tensor([rotor.root_cutout for rotor in vehicle.rotors])
        self.spin = tensor([rotor.spin for rotor in vehicle.rotors])
        self.axis = tensor([rotor.axis for rotor in vehicle.rotors])
        # Spin is counted about up for lift rotors, about the rearward axis for pushers, whose thrust points forward.
        self.sense = tensor([1.0 if rotor.kind == "lift" else -1.0 for rotor in vehicle.rotors])
        self.inclinations = self._inclinations()
        self._basis: dict[int, Tensor] = {}

    def basis(self, count: int) -> Tensor:
        """(station, control point) of blades with `count` control points."""
        if count not in self._basis:
            self._basis[count] = basis_matrix(self.radial, count, blade_degree(count))
        return self._basis[count]

    def _inclinations(self) -> list[Inclination]:
        """Places along `solved` where the inflow is not axial, and the model that holds there."""
        schedule = self.schedule
        edgewise, propelling = (
            torch.nonzero(where[schedule.solved])[:, 0] for where in (schedule.is_edgewise, schedule.is_propelling)
        )
        found = [Inclination(edgewise, EDGEWISE, EDGEWISE_GRAIN)] if len(edgewise) else []
        return (
            [*found, Inclination(propelling, inclined_rotor)] if schedule.mission.rotor_inflow == "inclined" else found
        )

    def __call__(self, design: Design, flight: FlightConditions) -> RotorOperation:
        schedule = self.schedule
        index, segment = schedule.solved_rotor, schedule.solved_segment
        radius = design.rotor_radius[..., index]
        rotor = Rotor(
            radius=radius,
            hub_radius=radius * self.root_cutout[index],
            chord=(design.blade_chord @ self.basis(design.blade_chord.shape[-1]).T)[..., index, :],
            twist=(design.blade_twist @ self.basis(design.blade_twist.shape[-1]).T)[..., index, :],
            blades=self.blades[index],
        )
        is_propelling = schedule.is_propelling[schedule.solved]
        blocks = [design.of_segments[speed_name(group)] for group in schedule.speed_groups]
        forward = (flight.speed * torch.cos(flight.angle_of_attack))[..., segment]
        # On its lift rotors the aircraft is level: air comes from above as fast as it climbs. On the wing it comes from below.
        upward = torch.where(
            schedule.is_edgewise[schedule.solved],
            -(flight.speed * torch.sin(flight.angle_of_attack))[..., segment],
            flight.vertical_rate[segment],
        )
        inflow = Inflow(
            axial_velocity=torch.where(is_propelling, forward, upward),
            rotation_speed=torch.cat(blocks, dim=-1)[..., schedule.speed_order[schedule.solved]],
            density=flight.air.density[..., segment],
            speed_of_sound=flight.air.speed_of_sound[..., segment],
            dynamic_viscosity=flight.air.dynamic_viscosity[..., segment],
        )
        polars = tuple(self.polars[i] for i in index)
        loads = rotor_loads(rotor, inflow, polars)
        disk_force = disk_moment = None
        for inclination in self.inclinations:
            wind = wind_direction(flight.angle_of_attack[..., segment]) * flight.speed[..., segment, None]
            turning = Turning(wind, self.axis[index], self.spin[index] * self.sense[index])
            loads, force, moment = inclined(loads, inclination, turning, polars)
            disk_force = force if disk_force is None else disk_force + force
            disk_moment = moment if disk_moment is None else disk_moment + moment
        return RotorOperation(schedule, loads, polars, disk_force, disk_moment)
