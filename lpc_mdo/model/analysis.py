"""From a design to everything that may be asked of it: the only place where the disciplines meet."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.config.layout import own_rotors
from lpc_mdo.disciplines.atmosphere import Atmosphere, standard_atmosphere
from lpc_mdo.disciplines.battery import BatteryState, energy_state_of_charge
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, TheveninState, pack_discharge
from lpc_mdo.disciplines.hover_noise import HoverNoise, observer_position
from lpc_mdo.disciplines.mass_properties import MassProperties, combine
from lpc_mdo.disciplines.motor import MotorOperation, operate_motor
from lpc_mdo.disciplines.motor_limits import maximum_torque
from lpc_mdo.disciplines.motor_sizing import Motor, MotorParameters, size_motor
from lpc_mdo.disciplines.trim import TrimResidual, stall_speed, trim_residual
from lpc_mdo.disciplines.vortex_lattice import LatticeLoads, vortex_lattice
from lpc_mdo.geometry.actuation import Axis, rotate
from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.geometry.shape import Geometry, Shape
from lpc_mdo.model.blade_airfoils import BladePolar, blade_polars, rotor_loads
from lpc_mdo.model.design import Design
from lpc_mdo.model.inclined_rotors import inclined_pusher, wind_direction
from lpc_mdo.model.parasitic_drag import ParasiticDrag
from lpc_mdo.model.rotor_noise import heard_by_observers, heard_in_hover
from lpc_mdo.model.structure_source import structural_calibration, structural_surrogate
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil
from lpc_mdo.surrogates.structural_mass import StructuralInputs, StructuralMassSurrogate

SEGMENTS = ("hover", "climb", "cruise")
BLADE_STATIONS = 28
LEAST_TORQUE = 1e-3  # N m: keeps the share of a motor finite that no currents within its limits drive
_BACKWARD = torch.tensor([1.0, 0.0, 0.0], dtype=torch.float64)


@dataclass(frozen=True)
class Weights:
    """Masses (...,) kg by group, and the whole aircraft's properties."""

    groups: dict[str, Tensor]
    total: MassProperties
    structural_inputs: StructuralInputs


@dataclass(frozen=True)
class Aerodynamics:
    """Forward flight, (..., 2): climb and cruise."""

    lattice: LatticeLoads
    parasitic_items: tuple[str, ...]
    parasitic_areas: Tensor  # (..., 2, item) m^2
    dynamic_pressure: Tensor  # Pa
    lift: Tensor  # N
    induced_drag: Tensor  # N
    parasitic_drag: Tensor  # N
    lift_coefficient: Tensor
    drag_coefficient: Tensor
    parasitic_drag_coefficient: Tensor
    lift_to_drag: Tensor
    maximum_lift_coefficient: Tensor
    stall_speed: Tensor  # m/s
    reference_area: Tensor  # (...,) m^2

    @property
    def parasitic_area(self) -> dict[str, Tensor]:
        """m^2 by item, each (..., 2)."""
        return dict(zip(self.parasitic_items, self.parasitic_areas.unbind(-1), strict=True))


@dataclass(frozen=True)
class Propulsion:
    """Rotor operating points (..., point): the lift rotors in hover, the pusher in climb and in cruise.

    What is solved, (..., solved), serves every point where `place` (point,) says; a mirrored aircraft is solved on one side.
    """

    solved_loads: RotorLoads
    solved_operation: MotorOperation
    place: Tensor
    polars: tuple[BladePolar, ...]  # one a point
    motors: Motor  # (..., rotor)
    torque_share: Tensor  # (..., point) air-gap torque over the motor's largest at the point's speed
    disk_force: Tensor  # (..., 2, 3) N of the pusher in the plane of its disk, zero in axial inflow
    disk_moment: Tensor  # (..., 2, 3) N m, likewise

    @property
    def loads(self) -> RotorLoads:
        """(..., point)."""
        return self.solved_loads.at(self.place)

    @property
    def operation(self) -> MotorOperation:
        """(..., point)."""
        return self.solved_operation.at(self.place)

    @property
    def figure_of_merit(self) -> Tensor:
        """(..., lift rotor)."""
        return self.solved_loads.figure_of_merit[..., self.place[:-2]]

    @property
    def propulsive_efficiency(self) -> Tensor:
        """(..., 2)."""
        return self.solved_loads.propulsive_efficiency[..., -2:]


@dataclass(frozen=True)
class Energy:
    """Electrical power and time of each segment (..., 3), and the battery along the flown sequence."""

    power: Tensor  # W
    duration: Tensor  # s, one flight
    reserve_duration: Tensor  # (...,) s
    battery: BatteryState | TheveninState  # as vehicle.battery.model says


@dataclass(frozen=True)
class Analysis:
    """Every output a person may ask for; leading dimensions as in the design."""

    design: Design
    shape: Shape
    flight: "FlightConditions"
    weights: Weights
    propulsion: Propulsion
    aerodynamics: Aerodynamics
    trim: TrimResidual  # (..., 3 segments, 3)
    scaled_trim: Tensor  # (..., 3 segments, 6) forces over weight, moments over weight x semi-span
    noise: HoverNoise  # for the mission's observer; spectra are those of the solved lift rotors
    observed_dba: Tensor  # (..., observer) dB(A): that observer, then the further ones
    energy: Energy

    @property
    def gross_mass(self) -> Tensor:
        return self.weights.total.mass


@dataclass(frozen=True)
class FlightConditions:
    """Speed, path angle, pitch and air of hover, climb, cruise, each (..., 3)."""

    speed: Tensor
    path_angle: Tensor
    pitch: Tensor
    air: Atmosphere

    @property
    def angle_of_attack(self) -> Tensor:
        return self.pitch - self.path_angle


class Analyzer:
    """Callable Design -> Analysis for one vehicle and mission; constant work is done once, here.

    `geometry`: that of a vehicle of the same shape, which is expensive to build; default: made of `vehicle`. `polars`:
    one a rotor; default: those of the sections that the file names. The wing stalls as the polar of its own section does. is_mirrored: every design has starboard lift rotors and
    motors like their port twins, whose loads then serve for both.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        mission: Mission,
        geometry: Geometry | None = None,
        polars: Sequence[BladePolar] | None = None,
        *,
        is_mirrored: bool = False,
    ) -> None:
        self.vehicle, self.mission = vehicle, mission
        self.geometry = geometry or Geometry(vehicle)
        self.wing_polar: AirfoilPolar = wing_polar(vehicle)
        self.structure: StructuralMassSurrogate = structural_surrogate(vehicle)
        self.structure_factor = structural_calibration(vehicle)
        self.motor_parameters = MotorParameters(dc_voltage=vehicle.motors.dc_voltage)
        radial = (torch.arange(BLADE_STATIONS, dtype=torch.float64) + 0.5) / BLADE_STATIONS
        self.polars = tuple(polars or blade_polars(vehicle, radial))
        twist_points, chord_points = (len(points) for points in (vehicle.pusher.twist, vehicle.pusher.chord))
        self.twist_basis = basis_matrix(radial, twist_points, blade_degree(twist_points))
        self.chord_basis = basis_matrix(radial, chord_points, blade_degree(chord_points))
        rotors = vehicle.rotors
        # The last rotor is the pusher: it has two operating points, climb and cruise.
        self.point_rotor = torch.tensor([*range(len(rotors)), len(rotors) - 1])
        own, place = own_rotors(vehicle) if is_mirrored else ([*range(len(rotors))],) * 2
        self.solved_rotor = torch.tensor([*own, own[-1]])
        self.place = torch.tensor([*place, place[-1] + 1])
        self.alike = torch.bincount(self.place[:-2]).double()  # lift rotors that each solved one stands for
        self.blades = _tensor([rotor.blades for rotor in rotors])
        self.root_cutout = _tensor([rotor.root_cutout for rotor in rotors])
        self.spin = _tensor([rotor.spin for rotor in rotors])
        self.fixed_mass = _tensor([item.mass for item in vehicle.fixed_masses])
        self.fixed_position = _tensor([item.position for item in vehicle.fixed_masses])
        self.span = _tensor(vehicle.wing.area * vehicle.wing.aspect_ratio).sqrt()
        self.parasitic_drag = ParasiticDrag(vehicle)
        self._fixed_inputs = {
            "fuselage_length": _tensor(vehicle.fuselage.length),
            "vertical_tail_area": _tensor(vehicle.vertical_tail.area),
        }
        # The regressions know no tail position: the horizontal tail's centre of gravity moves with its root.
        self._tail_share = _tensor([[float(name == "horizontal_tail"), 0.0, 0.0] for name in self.structure.components])
        self._battery_line = _tensor([0.0, *vehicle.battery.position[1:]])
        self._up, self._forward = _tensor([0.0, 0.0, 1.0]), _tensor([-1.0, 0.0, 0.0])

    def __call__(self, design: Design) -> Analysis:
        if design.cruise_speed is None:
            speed = torch.full_like(design.cruise_altitude, self.mission.cruise.speed)
            design = replace(design, cruise_speed=speed)
        shape = self.geometry(
            ShapeParameters(
                design.wing_area,
                design.wing_aspect_ratio,
                design.wing_twist,
                design.tail_area,
                design.tail_aspect_ratio,
                design.tail_position,
                design.rotor_radius,
            )
        )
        flight = self._flight_conditions(design)
        motors = size_motor(design.motor_diameter, design.motor_length, self.motor_parameters)
        weights = self._weights(design, shape, motors)
        propulsion = self._propulsion(design, motors, flight)
        aerodynamics = self._aerodynamics(design, shape, flight, weights.total.mass)
        trim = self._trim(shape, flight, weights.total, propulsion, aerodynamics)
        energy = self._energy(design, flight, propulsion.solved_operation.input_power)
        noise, observed_dba = self._noise(shape, propulsion.solved_loads)
        return Analysis(
            design=design,
            shape=shape,
            flight=flight,
            weights=weights,
            propulsion=propulsion,
            aerodynamics=aerodynamics,
            trim=trim,
            scaled_trim=trim.scaled(
                (weights.total.mass * GRAVITY)[..., None], 0.5 * self.span.expand(weights.total.mass.shape)[..., None]
            ),
            noise=noise,
            observed_dba=observed_dba,
            energy=energy,
        )

    def _flight_conditions(self, design: Design) -> FlightConditions:
        mission = self.mission
        middle_of_climb = 0.5 * (mission.hover.altitude + design.climb_end_altitude)
        hover = torch.full_like(middle_of_climb, mission.hover.altitude)
        altitude = torch.stack([hover, middle_of_climb, design.cruise_altitude], dim=-1)
        level = torch.zeros_like(design.pitch[..., :1])
        cruise, climb = design.cruise_speed, mission.climb.speed
        climb_speed = cruise if climb is None else torch.full_like(cruise, climb)
        still = torch.zeros_like(cruise)
        return FlightConditions(
            speed=torch.stack([still, climb_speed, cruise], dim=-1),
            path_angle=torch.stack([still, torch.asin(mission.climb.rate / climb_speed), still], dim=-1),
            pitch=torch.cat([level, design.pitch], dim=-1),
            air=standard_atmosphere(altitude, mission.temperature_offset),
        )

    def _weights(self, design: Design, shape: Shape, motors: Motor) -> Weights:
        vehicle = self.vehicle
        inputs = StructuralInputs(
            wing_area=shape.wing.area,
            wing_aspect_ratio=shape.wing.aspect_ratio,
            battery_mass=design.battery_mass,
            cruise_speed=design.cruise_speed,
            horizontal_tail_area=shape.tail.area,
            **self._fixed_inputs,
        )
        structure, factor = self.structure.guarded(inputs, vehicle.structure.outside_samples), self.structure_factor
        structure_mass = structure.mass * factor
        batch = structure_mass.shape[:-1]
        moved = design.tail_position - vehicle.horizontal_tail.root_quarter_chord[0]
        structure_position = structure.center_of_gravity + moved[..., None, None] * self._tail_share
        battery_position = design.battery_position[..., None, None] * _BACKWARD + self._battery_line
        mass = torch.cat(
            [
                structure_mass,
                motors.mass,
                design.battery_mass[..., None],
                self.fixed_mass.expand(*batch, -1),
            ],
            dim=-1,
        )
        position = torch.cat(
            [
                structure_position,
                shape.hubs,
                battery_position,
                self.fixed_position.expand(*batch, -1, -1),
            ],
            dim=-2,
        )
        points = mass.shape[-1] - structure_mass.shape[-1]
        own = torch.nn.functional.pad(structure.inertia * factor[:, None, None], (0, 0, 0, 0, 0, points))
        groups = dict(zip(structure.names, structure_mass.unbind(-1), strict=True))
        groups["lift_motors"] = motors.mass[..., :-1].sum(-1)
        groups["pusher_motor"] = motors.mass[..., -1]
        groups["battery"] = design.battery_mass
        groups["fixed"] = self.fixed_mass.sum().expand(batch)
        return Weights(groups, combine(mass, position, own), inputs)

    def _propulsion(self, design: Design, motors: Motor, flight: FlightConditions) -> Propulsion:
        index = self.solved_rotor
        lift_speed = design.lift_rotor_speed[..., index[:-2]]
        radius = design.rotor_radius[..., index]
        rotor = Rotor(
            radius=radius,
            hub_radius=radius * self.root_cutout[index],
            chord=(design.blade_chord @ self.chord_basis.T)[..., index, :],
            twist=(design.blade_twist @ self.twist_basis.T)[..., index, :],
            blades=self.blades[index],
        )
        forward_axial = (flight.speed * torch.cos(flight.angle_of_attack))[..., 1:]
        speed = torch.cat([lift_speed, design.pusher_speed], dim=-1)
        segment = torch.tensor([*[0] * lift_speed.shape[-1], 1, 2])
        inflow = Inflow(
            axial_velocity=torch.cat([torch.zeros_like(lift_speed), forward_axial], dim=-1),
            rotation_speed=speed,
            density=flight.air.density[..., segment],
            speed_of_sound=flight.air.speed_of_sound[..., segment],
            dynamic_viscosity=flight.air.dynamic_viscosity[..., segment],
        )
        loads = rotor_loads(rotor, inflow, [self.polars[i] for i in index])
        disk_force = disk_moment = torch.zeros(*loads.thrust.shape[:-1], 2, 3, dtype=torch.float64)
        if self.mission.rotor_inflow == "inclined":
            angle = flight.angle_of_attack[..., 1:]
            loads, disk_force, disk_moment = inclined_pusher(
                loads, flight.speed[..., 1:], angle, self.spin[-1], self.polars[-1]
            )
        circuit, gear = motors.circuit.at(index), self.vehicle.motors
        motor_torque = loads.torque / (gear.gear_ratio * gear.gear_efficiency)
        motor_speed = speed * gear.gear_ratio
        operation = operate_motor(circuit, motor_torque, motor_speed)
        torque_share = operation.air_gap_torque / maximum_torque(circuit, motor_speed).clamp(min=LEAST_TORQUE)
        return Propulsion(
            solved_loads=loads,
            solved_operation=operation,
            place=self.place,
            polars=tuple(self.polars[i] for i in self.point_rotor),
            motors=motors,
            torque_share=torque_share[..., self.place],
            disk_force=disk_force,
            disk_moment=disk_moment,
        )

    def _aerodynamics(self, design: Design, shape: Shape, flight: FlightConditions, mass: Tensor) -> Aerodynamics:
        vehicle = self.vehicle
        speed, density = flight.speed[..., 1:], flight.air.density[..., 1:]
        direction = wind_direction(flight.angle_of_attack[..., 1:])
        hinge = Axis.lateral(shape.tail_hinge[..., None, :])
        tail_mesh = rotate(shape.tail_mesh[..., None, :, :, :], hinge, design.tail_deflection)
        wing_mesh = shape.wing_mesh[..., None, :, :, :].expand(*tail_mesh.shape[:-3], *shape.wing_mesh.shape[-3:])
        reference = shape.wing.aerodynamic_center[..., None, :]
        lattice = vortex_lattice(
            [wing_mesh, tail_mesh], direction * speed[..., None], density, reference, is_symmetric=True
        )
        pressure = 0.5 * density * speed**2
        air = Atmosphere(*(getattr(flight.air, field.name)[..., 1:] for field in fields(Atmosphere)))
        areas = self.parasitic_drag.areas(shape, speed, air)
        total_area = areas.sum(-1)
        area = shape.wing.area[..., None]
        parasitic = pressure * total_area
        mach = speed / air.speed_of_sound
        reynolds = density * speed * shape.wing.mean_chord[..., None] / air.dynamic_viscosity
        maximum_lift = vehicle.wing.maximum_lift_factor * self.wing_polar.maximum_lift_coefficient(reynolds, mach)
        drag_force = lattice.induced_drag + parasitic
        return Aerodynamics(
            lattice=lattice,
            parasitic_items=self.parasitic_drag.names,
            parasitic_areas=areas,
            dynamic_pressure=pressure,
            lift=lattice.lift,
            induced_drag=lattice.induced_drag,
            parasitic_drag=parasitic,
            lift_coefficient=lattice.lift / (pressure * area),
            drag_coefficient=drag_force / (pressure * area),
            parasitic_drag_coefficient=total_area / area,
            lift_to_drag=lattice.lift / drag_force,
            maximum_lift_coefficient=maximum_lift,
            stall_speed=stall_speed(mass[..., None], density, area, maximum_lift),
            reference_area=shape.wing.area,
        )

    def _trim(
        self, shape: Shape, flight: FlightConditions, total: MassProperties, propulsion: Propulsion, aero: Aerodynamics
    ) -> TrimResidual:
        """Residual (..., 3 segments, 3): hover from the lift rotors, climb and cruise from pusher, lattice and drag."""
        up, forward, loads = self._up, self._forward, propulsion.solved_loads
        thrust = loads.thrust[..., self.place]
        reaction = -self.spin[self.point_rotor] * loads.torque[..., self.place]
        hover = trim_residual(
            forces=thrust[..., :-2, None] * up,
            points=shape.hubs[..., :-1, :],
            moments=reaction[..., :-2].sum(-1)[..., None] * up,
            center_of_gravity=total.center_of_gravity,
            mass=total.mass,
            pitch=flight.pitch[..., 0],
        )
        direction = wind_direction(flight.angle_of_attack[..., 1:])
        items = (aero.dynamic_pressure[..., None] * aero.parasitic_areas)[..., None] * direction[..., None, :]
        pusher = (thrust[..., -2:, None] * forward + propulsion.disk_force)[..., None, :]
        forces = torch.cat([aero.lattice.force[..., None, :], pusher, items], dim=-2)
        points = torch.cat(
            [
                shape.wing.aerodynamic_center[..., None, :],
                shape.hubs[..., -1:, :],
                self.parasitic_drag.points(shape),
            ],
            dim=-2,
        )
        cruise = trim_residual(
            forces=forces,
            points=points[..., None, :, :],
            # The pusher turns about the rearward axis seen from behind; its reaction rolls the aircraft.
            moments=aero.lattice.moment - reaction[..., -2:, None] * forward + propulsion.disk_moment,
            center_of_gravity=total.center_of_gravity[..., None, :],
            mass=total.mass[..., None],
            pitch=flight.pitch[..., 1:],
        )
        return TrimResidual(
            force=torch.cat([hover.force[..., None, :], cruise.force], dim=-2),
            moment=torch.cat([hover.moment[..., None, :], cruise.moment], dim=-2),
        )

    def _noise(self, shape: Shape, loads: RotorLoads) -> tuple[HoverNoise, Tensor]:
        """The lift rotors in hover at the mission's observer, who stands ahead of and below them in the plane of symmetry;
        and the levels (..., observer) dB(A) there and at the further elevations."""
        requirements = self.mission.requirements
        center, distance = shape.hubs[..., :-1, :].mean(-2), requirements.observer_distance
        own = self.solved_rotor[:-2]
        rotors = (loads, [self.polars[i] for i in self.solved_rotor], shape.hubs[..., own, :])
        models = {"requirements": requirements, "rotors": slice(0, len(own)), "alike": self.alike}
        observer = observer_position(center, distance, requirements.observer_elevation)
        noise = heard_in_hover(*rotors, observer, **models)
        if not requirements.further_observer_elevations:
            return noise, noise.total_dba[..., None]
        observers = torch.stack(
            [observer_position(center, distance, angle) for angle in requirements.further_observer_elevations], dim=-2
        )
        further = heard_by_observers(*rotors, observers, **models)
        return noise, torch.cat([noise.total_dba[..., None], further.total_dba], dim=-1)

    def _energy(self, design: Design, flight: FlightConditions, motor_power: Tensor) -> Energy:
        """Battery state along the flights flown and the reserve, which is flown at cruise power."""
        mission, battery = self.mission, self.vehicle.battery
        lift = (motor_power[..., :-2] * self.alike).sum(-1, keepdim=True)
        power = torch.cat([lift, motor_power[..., -2:]], dim=-1)
        climb_time = (design.climb_end_altitude - mission.hover.altitude) / mission.climb.rate
        _, climb_speed, cruise_speed = flight.speed.unbind(-1)
        climb_distance = climb_time * torch.sqrt(climb_speed**2 - mission.climb.rate**2)
        cruise_time = (mission.cruise.distance - climb_distance) / cruise_speed
        hover_time = torch.full_like(climb_time, mission.hover.duration)
        reserve = mission.reserve
        reserve_time = (
            torch.full_like(climb_time, reserve.duration)
            if reserve.distance is None
            else reserve.distance / cruise_speed
        )
        duration = torch.stack([hover_time, climb_time, cruise_time], dim=-1)
        flown_power = torch.cat([power] * mission.flights + [power[..., 2:]], dim=-1)
        flown_time = torch.cat([duration] * mission.flights + [reserve_time[..., None]], dim=-1)
        state: BatteryState | TheveninState
        if battery.model == "equivalent_circuit":
            state = pack_discharge(LG_M50, flown_power, flown_time, design.battery_mass, battery.specific_energy)
        else:
            state = energy_state_of_charge(
                flown_power, flown_time, design.battery_mass, battery.specific_energy, battery.discharge_efficiency
            )
        return Energy(power, duration, reserve_time, state)


def wing_polar(vehicle: Vehicle) -> AirfoilPolar:
    """The trained polar of the wing's section. Raises ValueError that says how to make one if there is none."""
    try:
        return resolve_airfoil(vehicle.wing.polar or vehicle.wing.airfoil)
    except ValueError as error:
        raise ValueError(f"wing.{error}") from None


def _tensor(values: object) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)
