"""The main problem: least gross mass of the Lift+Cruise over 109 design variables under 17 constraints.

So many with the published eight lift rotors; other layouts of the vehicle file have their own numbers.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import Battery, Bound, Mission, Vehicle
from lpc_mdo.config.layout import booms, mirror_pairs
from lpc_mdo.disciplines.equivalent_circuit import SUSTAINED_SHARE
from lpc_mdo.model.analysis import Analysis, Analyzer
from lpc_mdo.problems.lift_motors import least_lift_motor
from lpc_mdo.problems.outputs import gross_weight_outputs
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable


def gross_weight_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The 109-variable problem in its published form; bounds are the vehicle file's.

    `reduced_problem` is the same without what symmetry settles.
    """
    wing, tail, battery, rotors = vehicle.wing, vehicle.horizontal_tail, vehicle.battery, vehicle.rotors
    lift, pusher = vehicle.lift_rotors, vehicle.pusher
    motors, limits, bounds = vehicle.motors, mission.requirements, vehicle.bounds
    count, twists, chords = len(rotors), len(pusher.twist), len(pusher.chord)

    def by_rotor(name: str, unit: str, lift_bound: Bound, pusher_bound: Bound, initial: Any) -> Variable:
        """One number a rotor, with bounds of their own for lift rotors and pusher."""
        each = [lift_bound] * len(lift) + [pusher_bound]
        lower, upper, reasons = zip(*((bound.lower, bound.upper, bound.reason) for bound in each), strict=True)
        return Variable(name, unit, lower, upper, initial, (count,), reasons)

    altitude = Bound(
        lower=0.9 * mission.cruise.altitude,
        upper=1.1 * mission.cruise.altitude,
        reason="10 % about the mission's altitude: the study cruises at about 3300 ft",
    )
    lengths = [motors.lift_length] * len(lift) + [motors.pusher_length]
    bores = [motors.lift_bore] * len(lift) + [motors.pusher_bore]
    variables = (
        by_rotor(
            "rotor_radius", "m", bounds.lift_rotor_radius, bounds.pusher_radius, [rotor.radius for rotor in rotors]
        ),
        bounded_variable("blade_twist", "rad", bounds.blade_twist, [rotor.twist for rotor in rotors], (count, twists)),
        bounded_variable("blade_chord", "m", bounds.blade_chord, [rotor.chord for rotor in rotors], (count, chords)),
        by_rotor("motor_length", "m", bounds.lift_motor_length, bounds.pusher_motor_length, lengths),
        by_rotor("motor_diameter", "m", bounds.lift_motor_diameter, bounds.pusher_motor_diameter, bores),
        bounded_variable("wing_area", "m^2", bounds.wing_area, wing.area),
        bounded_variable("wing_aspect_ratio", "1", bounds.wing_aspect_ratio, wing.aspect_ratio),
        bounded_variable("wing_twist", "rad", bounds.wing_twist, [wing.incidence] * 5, (5,)),
        bounded_variable("tail_area", "m^2", bounds.tail_area, tail.area),
        bounded_variable("tail_aspect_ratio", "1", bounds.tail_aspect_ratio, tail.aspect_ratio),
        bounded_variable("tail_position", "m", bounds.tail_position, tail.root_quarter_chord[0]),
        bounded_variable("battery_mass", "kg", bounds.battery_mass, battery.mass),
        bounded_variable("battery_position", "m", bounds.battery_position, battery.position[0]),
        bounded_variable(
            "lift_rotor_speed", "rad/s", bounds.lift_rotor_speed, [rotor.speed for rotor in lift], (len(lift),)
        ),
        bounded_variable("pusher_speed", "rad/s", bounds.pusher_speed, pusher.speed, (2,)),  # climb, cruise
        bounded_variable("pitch", "rad", bounds.pitch, [mission.climb_path_angle, 0.0], (2,)),  # climb, cruise
        bounded_variable("tail_deflection", "rad", bounds.tail_deflection, 0.0, (2,)),  # climb, cruise
        bounded_variable("cruise_altitude", "m", altitude, mission.cruise.altitude),
        bounded_variable("climb_end_altitude", "m", altitude, mission.cruise.altitude),
    )

    pairs = mirror_pairs(vehicle)
    constraints = (
        Constraint("trim_residual", "1", imposed_trim, lower=0.0, upper=0.0, scale=0.1),
        Constraint(
            "final_state_of_charge",
            "1",
            lambda a: a.energy.battery.final_state_of_charge,
            lower=limits.minimum_final_state_of_charge,
            scale=0.1,
            limits_within=(0.0, 1.0),
        ),
        Constraint(
            "stall_speed",
            "m/s",
            lambda a: a.aerodynamics.stall_speed,
            upper=min(mission.climb_speed, mission.cruise.speed) - limits.stall_margin,
            scale=10.0,
            limits_within=(0.0, min(mission.climb_speed, mission.cruise.speed)),
        ),
        Constraint(
            "altitude_match",
            "m",
            lambda a: a.design.climb_end_altitude - a.design.cruise_altitude,
            0.0,
            0.0,
            scale=50.0,
        ),
        Constraint(
            "sound_pressure_level",
            "dB(A)",
            lambda a: a.observed_dba,
            upper=limits.maximum_sound_pressure_level,
            scale=3.0,
            limits_within=(0.0, 140.0),
        ),
        *(Constraint(f"rotor_symmetry_{lift[i].name}", "1", rotor_symmetry(i, j), 0.0, 0.0) for i, j in pairs),
        *tip_clearances(vehicle, limits.rotor_tip_clearance, bounds.lift_rotor_radius.upper),
        Constraint(
            "motor_torque_climb",
            "1",
            lambda a: a.propulsion.torque_share[..., -2],
            upper=1.0,
            scale=0.3,
            limits_within=(0.0, 1.0),
        ),
        Constraint(
            "motor_torque_cruise",
            "1",
            lambda a: a.propulsion.torque_share[..., -1],
            upper=1.0,
            scale=0.3,
            limits_within=(0.0, 1.0),
        ),
        *(Constraint(f"motor_symmetry_{lift[i].name}", "1", motor_symmetry(i, j), 0.0, 0.0) for i, j in pairs),
        *(battery_limits(battery) if battery.model == "equivalent_circuit" else ()),
    )

    problem = Problem(
        name="gross-weight",
        formulation="paper",
        variables=variables,
        constraints=constraints,
        objective=Objective("gross_mass", "kg", lambda a: a.gross_mass, scale=100.0),
        analyze_design=Analyzer(vehicle, mission),
        outputs=lambda a, start: gross_weight_outputs(a, start, vehicle),
    )
    return with_motors_that_hover(problem)


def with_motors_that_hover(problem: Problem[Analysis]) -> Problem[Analysis]:
    """The problem with start and bounds of the lift motors as its vehicle's file and rule say, in whatever formulation.

    The rule, `least_lift_motor`, raises lower bounds, and starts below them. Whatever they were before does not matter.
    """
    vehicle = problem.analyze_design.vehicle
    bounds, motors = vehicle.bounds, vehicle.motors
    sizes = {
        "motor_length": (bounds.lift_motor_length, motors.lift_length),
        "motor_diameter": (bounds.lift_motor_diameter, motors.lift_bore),
    }
    plain = _with_lift_motors(problem, {name: (file, file.lower, start) for name, (file, start) in sizes.items()})
    if motors.lift_bounds == "file":
        return plain
    with torch.no_grad():
        least = least_lift_motor(vehicle, plain.analyze(plain.x0))
    floors = {"motor_length": least.length, "motor_diameter": least.bore}
    raised = {
        name: (
            file.model_copy(update={"reason": least.reason}) if floors[name] > file.lower else file,
            max(floors[name], file.lower),
            max(floors[name], start),
        )
        for name, (file, start) in sizes.items()
    }
    return _with_lift_motors(problem, raised)


def _with_lift_motors(problem: Problem[Analysis], sizes: Mapping[str, tuple[Bound, float, float]]) -> Problem[Analysis]:
    """bound with its reason, lower bound and start of all lift motors by the variable's name; the pusher's stay."""

    def changed(variable: Variable) -> Variable:
        if variable.name not in sizes:
            return variable
        (file, lower, start), lift = sizes[variable.name], variable.count - 1
        return replace(
            variable,
            lower=[lower] * lift + variable.lower_tensor[lift:].tolist(),
            initial=[start] * lift + variable.initial_tensor[lift:].tolist(),
            reason=[file.reason] * lift + list(variable.reasons[lift:]),
        )

    return replace(problem, variables=tuple(changed(variable) for variable in problem.variables))


def battery_limits(battery: Battery) -> tuple[Constraint[Analysis], ...]:
    """What the equivalent circuit adds to the published rows: per segment, voltage, current and a power it can sustain."""
    return (
        Constraint(
            "cell_voltage",
            "V",
            lambda a: a.energy.battery.lowest_voltage,
            lower=battery.minimum_cell_voltage,
            scale=0.3,
            limits_within=(0.5, 5.0),
        ),
        Constraint(
            "discharge_rate",
            "1/h",
            lambda a: a.energy.battery.highest_rate,
            upper=battery.maximum_discharge_rate,
            limits_within=(0.0, 100.0),
        ),
        Constraint(
            "battery_power_margin",
            "1",
            lambda a: a.energy.battery.power_margin,
            lower=1.0 - SUSTAINED_SHARE,
            scale=0.3,
            limits_within=(1.0 - SUSTAINED_SHARE, 1.0),
        ),
    )


def bounded_variable(name: str, unit: str, bound: Bound, initial: Any, size: tuple[int, ...] = ()) -> Variable:
    """A block with the vehicle file's bounds and their reason."""
    return Variable(name, unit, bound.lower, bound.upper, initial, size, bound.reason)


def imposed_trim(a: Analysis) -> Tensor:
    """The components of the scaled trim residual that symmetry does not settle, (..., 8).

    Hover: vertical force, pitching moment; climb and cruise: both forces in the plane of symmetry, pitching moment. In
    hover the longitudinal force is zero for vertical rotors, and all lateral components vanish by the symmetry of the
    vehicle file and the symmetry rows, but the pusher's torque reaction: the result reports it, and ailerons, which are not
    modelled, are assumed to hold it. To impose the others would repeat rows.
    """
    hover, forward = a.scaled_trim[..., 0, [2, 4]], a.scaled_trim[..., 1:, [0, 2, 4]]
    return torch.cat([hover, forward.flatten(-2)], dim=-1)


def rotor_symmetry(port: int, starboard: int):
    """Differences between two rotors (..., 8): radius, chord, twist and speed, over lengths and speeds of their size."""

    def difference(a: Analysis) -> Tensor:
        d = a.design
        parts = [
            (d.rotor_radius[..., port] - d.rotor_radius[..., starboard])[..., None],
            (d.blade_chord[..., port, :] - d.blade_chord[..., starboard, :]) / 0.2,
            (d.blade_twist[..., port, :] - d.blade_twist[..., starboard, :]) / 0.5,
            (d.lift_rotor_speed[..., port] - d.lift_rotor_speed[..., starboard])[..., None] / 50.0,
        ]
        return torch.cat(parts, dim=-1)

    return difference


def motor_symmetry(port: int, starboard: int):
    """Differences between two motors (..., 2): length and diameter, over 0.1 m."""

    def difference(a: Analysis) -> Tensor:
        both = torch.stack([a.design.motor_length, a.design.motor_diameter], dim=-1)
        return (both[..., port, :] - both[..., starboard, :]) / 0.1

    return difference


def tip_clearances(vehicle: Vehicle, least: float, largest_radius: float) -> list[Constraint[Analysis]]:
    """A row for every two rotors that could touch, with the gaps to port and to starboard: neighbours across the span, ahead
    of the wing and behind it; and the two of a boom, unless bounds keep them apart."""
    side, rows = booms(vehicle), []

    def add(name: str, one: tuple[int, int], other: tuple[int, int], axis: int) -> None:
        rows.append(
            Constraint(
                name, "m", tip_clearance(one, other, axis), lower=least, scale=0.3, limits_within=(0.0, math.inf)
            )
        )

    for place in ("front", "rear"):
        across = [pair for pair in (getattr(boom, place) for boom in side) if pair is not None]
        neighbours = list(pairwise(across))
        for number, (outer, inner) in enumerate(neighbours, start=1):
            add(f"tip_clearance_{place}" + (f"_{number}" if len(neighbours) > 1 else ""), outer, inner, 1)
    for number, boom in enumerate(side, start=1):
        if boom.front and boom.rear:
            front, rear = (vehicle.lift_rotors[port].hub[0] for port, _ in boom.rotors)
            if rear - front < 2.0 * largest_radius + least:
                add(f"tip_clearance_boom_{number}", boom.front, boom.rear, 0)
    return rows


def tip_clearance(one: tuple[int, int], other: tuple[int, int], axis: int):
    """Gap (..., 2) m along an axis between the tips of two rotors, port and starboard; indices (port, starboard)."""
    first, second = torch.tensor(one), torch.tensor(other)

    def gap(a: Analysis) -> Tensor:
        hubs, radius = a.shape.hubs, a.design.rotor_radius
        distance = (hubs[..., first, axis] - hubs[..., second, axis]).abs()
        return distance - radius[..., first] - radius[..., second]

    return gap
