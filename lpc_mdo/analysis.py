"""From a design to everything that may be asked of it: the only place where the disciplines meet."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.design import Design
from lpc_mdo.disciplines import drag
from lpc_mdo.disciplines.atmosphere import Atmosphere, standard_atmosphere
from lpc_mdo.disciplines.battery import BatteryState, energy_state_of_charge
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, TheveninState, pack_discharge
from lpc_mdo.disciplines.hover_noise import TONAL_MODELS, HoverNoise, hover_noise, observer_position
from lpc_mdo.disciplines.mass_properties import MassProperties, combine
from lpc_mdo.disciplines.motor import MotorOperation, maximum_torque, operate_motor
from lpc_mdo.disciplines.motor_sizing import Motor, MotorParameters, size_motor
from lpc_mdo.disciplines.tonal_noise import BladeLoading
from lpc_mdo.disciplines.trim import TrimResidual, stall_speed, trim_residual
from lpc_mdo.disciplines.vortex_lattice import LatticeLoads, vortex_lattice
from lpc_mdo.geometry.actuation import Axis, rotate
from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.geometry.shape import Geometry, Shape
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.structure_source import structural_calibration, structural_surrogate
from surrogates.airfoil import AirfoilPolar, load_airfoil
from surrogates.structural_mass import StructuralInputs, StructuralMassSurrogate

SEGMENTS = ("hover", "climb", "cruise")
BLADE_STATIONS = 28


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
    parasitic_area: dict[str, Tensor]  # m^2 by item, each (..., 2)
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


@dataclass(frozen=True)
class Propulsion:
    """Rotor operating points (..., 10): eight lift rotors in hover, the pusher in climb and in cruise."""

    loads: RotorLoads
    motors: Motor  # (..., 9)
    operation: MotorOperation  # (..., 10)
    torque_share: Tensor  # (..., 10) motor torque over the largest at the point's speed
    figure_of_merit: Tensor  # (..., 8)
    propulsive_efficiency: Tensor  # (..., 2)


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
    noise: HoverNoise  # for the mission's observer
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

    `geometry`: that of a vehicle of the same shape, which is dear to build; made of `vehicle` if left out.
    """

    def __init__(self, vehicle: Vehicle, mission: Mission, geometry: Geometry | None = None) -> None:
        self.vehicle, self.mission = vehicle, mission
        self.geometry = geometry or Geometry(vehicle)
        self.polar: AirfoilPolar = load_airfoil("naca4412")
        self.structure: StructuralMassSurrogate = structural_surrogate(vehicle)
        self.structure_factor = structural_calibration(vehicle)
        self.motor_parameters = MotorParameters(dc_voltage=vehicle.motors.dc_voltage)
        radial = (torch.arange(BLADE_STATIONS, dtype=torch.float64) + 0.5) / BLADE_STATIONS
        twist_points, chord_points = (len(points) for points in (vehicle.pusher.twist, vehicle.pusher.chord))
        self.twist_basis = basis_matrix(radial, twist_points, blade_degree(twist_points))
        self.chord_basis = basis_matrix(radial, chord_points, blade_degree(chord_points))
        rotors = vehicle.rotors
        self.point_rotor = torch.tensor([*range(8), 8, 8])
        self.blades = _tensor([rotor.blades for rotor in rotors])[self.point_rotor]
        self.root_cutout = _tensor([rotor.root_cutout for rotor in rotors])[self.point_rotor]
        self.spin = _tensor([rotor.spin for rotor in rotors])
        self.fixed_mass = _tensor([item.mass for item in vehicle.fixed_masses])
        self.fixed_position = _tensor([item.position for item in vehicle.fixed_masses])
        self.span = _tensor(vehicle.wing.area * vehicle.wing.aspect_ratio).sqrt()

    def __call__(self, design: Design) -> Analysis:
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
        trim = self._trim(shape, flight, weights.total, propulsion.loads, aerodynamics)
        energy = self._energy(design, propulsion.operation.input_power)
        noise, observed_dba = self._noise(shape, propulsion.loads)
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
        return FlightConditions(
            speed=_tensor([0.0, mission.climb.speed, mission.cruise.speed]),
            path_angle=_tensor([0.0, mission.climb.path_angle, 0.0]),
            pitch=torch.cat([level, design.pitch], dim=-1),
            air=standard_atmosphere(altitude, mission.temperature_offset),
        )

    def _weights(self, design: Design, shape: Shape, motors: Motor) -> Weights:
        vehicle = self.vehicle
        inputs = StructuralInputs(
            wing_area=shape.wing.area,
            wing_aspect_ratio=shape.wing.aspect_ratio,
            fuselage_length=_tensor(vehicle.fuselage.length),
            battery_mass=design.battery_mass,
            cruise_speed=_tensor(self.mission.cruise.speed),
            horizontal_tail_area=shape.tail.area,
            vertical_tail_area=_tensor(vehicle.vertical_tail.area),
        )
        structure, factor = self.structure.guarded(inputs, vehicle.structure.outside_samples), self.structure_factor
        batch = structure.mass.shape[:-1]
        # The regressions know no tail position: the horizontal tail's centre of gravity moves with its root.
        is_tail = _tensor([float(name == "horizontal_tail") for name in structure.names])
        moved = (design.tail_position - vehicle.horizontal_tail.root_quarter_chord[0])[..., None] * is_tail
        structure_position = structure.center_of_gravity + moved[..., None] * _tensor([1.0, 0.0, 0.0])
        battery_position = torch.stack(
            torch.broadcast_tensors(design.battery_position, *_tensor(vehicle.battery.position[1:])), dim=-1
        )
        mass = torch.cat(
            [
                structure.mass * factor,
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
                battery_position[..., None, :],
                self.fixed_position.expand(*batch, -1, -1),
            ],
            dim=-2,
        )
        points = mass.shape[-1] - structure.mass.shape[-1]
        own = torch.cat(
            [structure.inertia * factor[:, None, None], torch.zeros(*batch, points, 3, 3, dtype=mass.dtype)], dim=-3
        )
        groups = {name: structure.mass[..., i] * factor[i] for i, name in enumerate(structure.names)}
        groups["lift_motors"] = motors.mass[..., :8].sum(-1)
        groups["pusher_motor"] = motors.mass[..., 8]
        groups["battery"] = design.battery_mass
        groups["fixed"] = self.fixed_mass.sum().expand(batch)
        return Weights(groups, combine(mass, position, own), inputs)

    def _propulsion(self, design: Design, motors: Motor, flight: FlightConditions) -> Propulsion:
        index = self.point_rotor
        radius = design.rotor_radius[..., index]
        rotor = Rotor(
            radius=radius,
            hub_radius=radius * self.root_cutout,
            chord=(design.blade_chord @ self.chord_basis.T)[..., index, :],
            twist=(design.blade_twist @ self.twist_basis.T)[..., index, :],
            blades=self.blades,
        )
        forward_axial = (flight.speed * torch.cos(flight.angle_of_attack))[..., 1:]
        speed = torch.cat([design.lift_rotor_speed, design.pusher_speed], dim=-1)
        hover = torch.zeros_like(design.lift_rotor_speed)
        inflow = Inflow(
            axial_velocity=torch.cat([hover, forward_axial], dim=-1),
            rotation_speed=speed,
            density=_at_points(flight.air.density),
            speed_of_sound=_at_points(flight.air.speed_of_sound),
            dynamic_viscosity=_at_points(flight.air.dynamic_viscosity),
        )
        loads = blade_element_momentum(rotor, inflow, self.polar)
        circuit, gear = motors.circuit.at(index), self.vehicle.motors
        motor_torque = loads.torque / (gear.gear_ratio * gear.gear_efficiency)
        motor_speed = speed * gear.gear_ratio
        return Propulsion(
            loads=loads,
            motors=motors,
            operation=operate_motor(circuit, motor_torque, motor_speed),
            torque_share=motor_torque / maximum_torque(circuit, motor_speed),
            figure_of_merit=loads.figure_of_merit[..., :8],
            propulsive_efficiency=loads.propulsive_efficiency[..., 8:],
        )

    def _aerodynamics(self, design: Design, shape: Shape, flight: FlightConditions, mass: Tensor) -> Aerodynamics:
        vehicle = self.vehicle
        speed, density = flight.speed[1:], flight.air.density[..., 1:]
        direction = _wind_direction(flight.angle_of_attack[..., 1:])
        hinge = Axis.lateral(shape.tail_hinge[..., None, :])
        tail_mesh = rotate(shape.tail_mesh[..., None, :, :, :], hinge, design.tail_deflection)
        wing_mesh = shape.wing_mesh[..., None, :, :, :].expand(*tail_mesh.shape[:-3], *shape.wing_mesh.shape[-3:])
        reference = shape.wing.aerodynamic_center[..., None, :]
        lattice = vortex_lattice(
            [wing_mesh, tail_mesh], direction * speed[:, None], density, reference, is_symmetric=True
        )
        pressure = 0.5 * density * speed**2
        areas = self._parasitic_areas(shape, flight)
        total_area = torch.stack(list(areas.values())).sum(0)
        area = shape.wing.area[..., None]
        parasitic = pressure * total_area
        mach = speed / flight.air.speed_of_sound[..., 1:]
        reynolds = density * speed * shape.wing.mean_chord[..., None] / flight.air.dynamic_viscosity[..., 1:]
        maximum_lift = vehicle.wing.maximum_lift_factor * self.polar.maximum_lift_coefficient(reynolds, mach)
        drag_force = lattice.induced_drag + parasitic
        return Aerodynamics(
            lattice=lattice,
            parasitic_area=areas,
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

    def _parasitic_areas(self, shape: Shape, flight: FlightConditions) -> dict[str, Tensor]:
        """Drag areas (..., 2) m^2 by item; the leakage allowance multiplies the wetted items."""
        vehicle, factors = self.vehicle, self.vehicle.drag
        speed = flight.speed[1:]
        mach = speed / flight.air.speed_of_sound[..., 1:]
        unit_reynolds = flight.air.density[..., 1:] * speed / flight.air.dynamic_viscosity[..., 1:]

        def friction(length: Tensor) -> Tensor:
            return drag.turbulent_friction_coefficient(unit_reynolds * length[..., None], mach)

        def surface(area: Tensor, chord: Tensor, thickness: float, interference: float) -> Tensor:
            wetted = drag.surface_wetted_area(area, thickness)[..., None]
            return wetted * friction(chord) * drag.surface_form_factor(thickness, mach) * interference

        body, booms, fin = vehicle.fuselage, vehicle.booms, vehicle.vertical_tail
        length = _tensor(body.length)
        diameter = (body.width * body.height) ** 0.5
        boom_wetted = 2.0 * drag.tube_wetted_area(shape.boom_length, booms.diameter).sum(-1)
        boom_length = shape.boom_length.mean(-1)
        fin_area, fin_chord = _tensor(fin.area), _tensor((fin.area / fin.aspect_ratio) ** 0.5)
        wetted = {
            "fuselage": shape.fuselage_wetted_area[..., None]
            * friction(length)
            * drag.body_form_factor(length, diameter)
            * factors.fuselage_interference,
            "booms": boom_wetted[..., None]
            * friction(boom_length)
            * drag.body_form_factor(boom_length, booms.diameter)[..., None]
            * factors.boom_interference,
            "wing": surface(
                shape.wing.area,
                shape.wing.mean_chord,
                vehicle.wing.thickness_to_chord,
                factors.wing_interference,
            ),
            "horizontal_tail": surface(
                shape.tail.area,
                shape.tail.mean_chord,
                vehicle.horizontal_tail.thickness_to_chord,
                factors.tail_interference,
            ),
            "vertical_tail": surface(fin_area, fin_chord, fin.thickness_to_chord, factors.tail_interference),
        }
        allowance = 1.0 + factors.leakage_and_protuberance
        rows = {name: area * allowance for name, area in wetted.items()}
        rows |= {row.name: torch.full_like(rows["wing"], row.area) for row in factors.areas}
        return {name: torch.broadcast_to(area, rows["wing"].shape) for name, area in rows.items()}

    def _drag_points(self, shape: Shape) -> list[Tensor]:
        """Where each parasitic item acts (..., 3) m, in the order of `_parasitic_areas`."""
        body, fin = self.vehicle.fuselage, self.vehicle.vertical_tail
        middle = 0.5 * (_tensor(body.nose) + _tensor(body.rear))
        mid_span = 0.5 * (fin.area * fin.aspect_ratio) ** 0.5
        return [
            middle,
            shape.hubs[..., :8, :].mean(-2),
            shape.wing.aerodynamic_center,
            shape.tail.aerodynamic_center,
            _tensor(fin.root_quarter_chord) + _tensor([0.0, 0.0, mid_span]),
            *(_tensor(row.position) for row in self.vehicle.drag.areas),
        ]

    def _trim(
        self, shape: Shape, flight: FlightConditions, total: MassProperties, loads: RotorLoads, aero: Aerodynamics
    ) -> TrimResidual:
        """Residual (..., 3 segments, 3): hover from the lift rotors, climb and cruise from pusher, lattice and drag."""
        batch = total.mass.shape
        up, forward, zero = _tensor([0.0, 0.0, 1.0]), _tensor([-1.0, 0.0, 0.0]), _tensor([0.0, 0.0, 0.0])
        thrust, reaction = loads.thrust, -self.spin[self.point_rotor] * loads.torque
        hover = trim_residual(
            forces=thrust[..., :8, None] * up,
            points=shape.hubs[..., :8, :],
            moments=reaction[..., :8].sum(-1)[..., None] * up,
            center_of_gravity=total.center_of_gravity,
            mass=total.mass,
            pitch=flight.pitch[..., 0],
        )
        direction = _wind_direction(flight.angle_of_attack[..., 1:])
        area = torch.stack(list(aero.parasitic_area.values()), dim=-1)  # (..., 2, item)
        items = (aero.dynamic_pressure[..., None] * area)[..., None] * direction[..., None, :]
        pusher = thrust[..., 8:, None, None] * forward
        forces = torch.cat([aero.lattice.force[..., None, :], pusher, items], dim=-2)
        points = torch.stack(
            [
                point.expand(*batch, 3)
                for point in (shape.wing.aerodynamic_center, shape.hubs[..., 8, :], *self._drag_points(shape))
            ],
            dim=-2,
        )
        cruise = trim_residual(
            forces=forces,
            points=points[..., None, :, :],
            # The pusher turns about the rearward axis seen from behind; its reaction rolls the aircraft.
            moments=aero.lattice.moment - reaction[..., 8:, None] * forward + zero,
            center_of_gravity=total.center_of_gravity[..., None, :],
            mass=total.mass[..., None],
            pitch=flight.pitch[..., 1:],
        )
        return TrimResidual(
            force=torch.cat([hover.force[..., None, :], cruise.force], dim=-2),
            moment=torch.cat([hover.moment[..., None, :], cruise.moment], dim=-2),
        )

    def _noise(self, shape: Shape, loads: RotorLoads) -> tuple[HoverNoise, Tensor]:
        """The eight lift rotors in hover at the mission's observer, who stands ahead of and below them; and the levels
        (..., observer) dB(A) there and at the further elevations."""
        requirements = self.mission.requirements
        hubs = shape.hubs[..., :8, :]
        hover = slice(0, 8)
        loading = BladeLoading(
            radius=loads.station_radius[..., hover, :],
            width=loads.station_width[..., hover, :],
            thrust_per_length=loads.thrust_per_length[..., hover, :],
            torque_per_length=loads.torque_per_length[..., hover, :],
            chord=loads.rotor.chord[..., hover, :],
            thickness_to_chord=0.12,  # NACA 4412
            pitch_angle=loads.rotor.twist[..., hover, :],
            blades=self.blades[hover],
            rotation_speed=loads.inflow.rotation_speed[..., hover],
            density=loads.inflow.density[..., hover],
            speed_of_sound=loads.inflow.speed_of_sound[..., hover],
        )
        thrust, radius, alpha = (
            loads.thrust[..., hover],
            loads.rotor.radius[..., hover],
            loads.angle_of_attack[..., hover, :],
        )
        models = {
            "convention": requirements.acoustic_convention,
            "tonal_model": TONAL_MODELS[requirements.tonal_model],
            "broadband_model": requirements.broadband_model,
        }
        center, distance = hubs.mean(-2), requirements.observer_distance
        observer = observer_position(center, distance, requirements.observer_elevation)
        noise = hover_noise(loading, thrust, radius, alpha, hubs, observer, **models)
        if not requirements.further_observer_elevations:
            return noise, noise.total_dba[..., None]
        observers = torch.stack(
            [observer_position(center, distance, angle) for angle in requirements.further_observer_elevations], dim=-2
        )
        further = hover_noise(
            loading.per_observer(),
            thrust[..., None, :],
            radius[..., None, :],
            alpha[..., None, :, :],
            hubs[..., None, :, :],
            observers,
            **models,
        )
        return noise, torch.cat([noise.total_dba[..., None], further.total_dba], dim=-1)

    def _energy(self, design: Design, motor_power: Tensor) -> Energy:
        """Battery state along the flights flown and the reserve, which is flown at cruise power."""
        mission, battery = self.mission, self.vehicle.battery
        power = torch.cat([motor_power[..., :8].sum(-1, keepdim=True), motor_power[..., 8:]], dim=-1)
        climb_time = (design.climb_end_altitude - mission.hover.altitude) / mission.climb.rate
        climb_distance = climb_time * (mission.climb.speed**2 - mission.climb.rate**2) ** 0.5
        cruise_time = (mission.cruise.distance - climb_distance) / mission.cruise.speed
        hover_time = torch.full_like(climb_time, mission.hover.duration)
        reserve_time = torch.full_like(climb_time, mission.reserve.distance / mission.cruise.speed)
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


def _tensor(values: object) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


def _at_points(value: Tensor) -> Tensor:
    """Segment values (..., 3) at the ten rotor operating points (..., 10)."""
    return torch.cat([value[..., :1].expand(*value.shape[:-1], 8), value[..., 1:]], dim=-1)


def _wind_direction(angle_of_attack: Tensor) -> Tensor:
    """Unit vector (..., 3) along the free stream in geometry axes."""
    return torch.stack(
        [torch.cos(angle_of_attack), torch.zeros_like(angle_of_attack), torch.sin(angle_of_attack)], dim=-1
    )
