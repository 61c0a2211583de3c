"""The design variables of an aircraft and of its segments, with the vehicle file's bounds and reasons."""

import math
from typing import Any

from lpc_mdo.config import Bound, Vehicle
from lpc_mdo.config.bounds import Bounds, range_of
from lpc_mdo.config.layout import mirror_pairs
from lpc_mdo.config.segments import Segment
from lpc_mdo.disciplines.atmosphere import HIGHEST, LOWEST
from lpc_mdo.model.schedule import Schedule, altitude_name, end_altitude_name, speed_name
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.problem import Variable

OF_BOTH_KINDS = ("lift_rotor_radius", "lift_motor_length", "lift_motor_diameter")  # the pusher's ranges are the same
ALTITUDE_RANGE = 0.1  # of a level segment's altitude in the mission file
WING_TWISTS = 5


def aircraft_variables(vehicle: Vehicle) -> tuple[Variable, ...]:
    """What is built: rotors, motors, wing, tail, battery."""
    wing, tail, battery, rotors = vehicle.wing, vehicle.horizontal_tail, vehicle.battery, vehicle.rotors
    motors, bounds = vehicle.motors, vehicle.bounds
    count, twists, chords = len(rotors), len(rotors[0].twist), len(rotors[0].chord)
    port_of = {starboard: port for port, starboard in mirror_pairs(vehicle)}
    twins = tuple(port_of.get(i, i) for i in range(count))

    def by_kind(name: str, lift_bound: Bound, pusher_bound: Bound, initial: Any) -> Variable:
        """One number a rotor, with bounds of their own for lift rotors and pushers; m."""
        each = [lift_bound if rotor.kind == "lift" else pusher_bound for rotor in rotors]
        lower, upper, reasons = zip(*((bound.lower, bound.upper, bound.reason) for bound in each), strict=True)
        return Variable(name, "m", lower, upper, initial, (count,), reasons, twins)

    def by_rotor(name: str, unit: str, bound: Bound, initial: Any, points: int) -> Variable:
        return bounded_variable(name, unit, bound, initial, (count, points), twins)

    lengths = [motors.lift_length if rotor.kind == "lift" else motors.pusher_length for rotor in rotors]
    bores = [motors.lift_bore if rotor.kind == "lift" else motors.pusher_bore for rotor in rotors]
    radii = [rotor.radius for rotor in rotors]
    return (
        by_kind("rotor_radius", bounds.lift_rotor_radius, bounds.pusher_radius, radii),
        by_rotor("blade_twist", "rad", bounds.blade_twist, [rotor.twist for rotor in rotors], twists),
        by_rotor("blade_chord", "m", bounds.blade_chord, [rotor.chord for rotor in rotors], chords),
        by_kind("motor_length", bounds.lift_motor_length, bounds.pusher_motor_length, lengths),
        by_kind("motor_diameter", bounds.lift_motor_diameter, bounds.pusher_motor_diameter, bores),
        bounded_variable("wing_area", "m^2", bounds.wing_area, wing.area),
        bounded_variable("wing_aspect_ratio", "1", bounds.wing_aspect_ratio, wing.aspect_ratio),
        bounded_variable("wing_twist", "rad", bounds.wing_twist, [wing.incidence] * WING_TWISTS, (WING_TWISTS,)),
        bounded_variable("tail_area", "m^2", bounds.tail_area, tail.area),
        bounded_variable("tail_aspect_ratio", "1", bounds.tail_aspect_ratio, tail.aspect_ratio),
        bounded_variable("tail_position", "m", bounds.tail_position, tail.root_quarter_chord[0]),
        bounded_variable("battery_mass", "kg", bounds.battery_mass, battery.mass),
        bounded_variable("battery_position", "m", bounds.battery_position, battery.position[0]),
    )


def segment_variables(schedule: Schedule) -> tuple[Variable, ...]:
    """How it is flown: rotor speeds of each group, pitch and tail of each segment on the wing, altitudes."""
    bounds, mission = schedule.vehicle.bounds, schedule.mission
    names = schedule.wingborne_names
    pitch = [mission.path_angle(name) for name in names]
    return (
        *(rotor_speeds(schedule, group) for group in schedule.speed_groups),
        bounded_variable("pitch", "rad", bounds.pitch, pitch, (len(names),)),
        bounded_variable("tail_deflection", "rad", bounds.tail_deflection, 0.0, (len(names),)),
        *(
            _altitude(altitude_name(segment.name), _level(segment))
            for segment in schedule.segments
            if segment.is_altitude_free
        ),
        *(
            _altitude(end_altitude_name(name), _level(mission.segment(other)), altitude_name(other))
            for name, other in free_ends(schedule)
        ),
    )


def _level(segment: Segment) -> float:
    return present(segment.level_altitude, f"a level altitude of {segment.name!r}")


def rotor_speeds(schedule: Schedule, group: str) -> Variable:
    """(point of the group,) rad/s."""
    vehicle, points = schedule.vehicle, [schedule.points[k] for k in schedule.of_group(group)]
    kind = vehicle.rotors[points[0].rotor].kind
    bound = vehicle.bounds.lift_rotor_speed if kind == "lift" else vehicle.bounds.pusher_speed
    port_of = {starboard: port for port, starboard in mirror_pairs(vehicle)}
    places = {(point.rotor, point.segment): k for k, point in enumerate(points)}
    twins = tuple(
        places[port_of.get(point.rotor, point.rotor) if schedule.is_symmetric(point) else point.rotor, point.segment]
        for point in points
    )
    # Thrust goes with the square of the speed.
    shares = [schedule.segments[point.segment].rotor_share if kind == "lift" else 1.0 for point in points]
    initial = [
        max(vehicle.rotors[point.rotor].speed * math.sqrt(share), bound.lower)
        if share < 1.0
        else vehicle.rotors[point.rotor].speed
        for point, share in zip(points, shares, strict=True)
    ]
    return bounded_variable(speed_name(group), "rad/s", bound, initial, (len(points),), twins)


def free_ends(schedule: Schedule) -> list[tuple[str, str]]:
    """Climbs that end at the altitude of a level segment, which is a variable, and that segment: both by name.

    The published problem has a variable for either, and a row that makes them equal. A descent begins there without more.
    """
    found = []
    for segment in schedule.segments:
        after = schedule.mission.after(segment.name) if segment.level_altitude is None else None
        if after is not None and after.is_altitude_free and segment.vertical_rate > 0.0:
            found.append((segment.name, after.name))
    return found


def _altitude(name: str, altitude: float, follows: str = "") -> Variable:
    low, high = (1.0 - ALTITUDE_RANGE) * altitude, (1.0 + ALTITUDE_RANGE) * altitude
    reason = f"{100.0 * ALTITUDE_RANGE:g} % about the mission's altitude: the study cruises at about 3300 ft"
    return Variable(name, "m", low, high, altitude, reason=reason, follows=follows)


def bounded_variable(
    name: str, unit: str, bound: Bound, initial: Any, size: tuple[int, ...] = (), twins: tuple[int, ...] = ()
) -> Variable:
    """A block with the vehicle file's bounds and their reason."""
    is_mirrored = bool(twins) and twins != tuple(range(len(twins)))
    return Variable(name, unit, bound.lower, bound.upper, initial, size, bound.reason, twins if is_mirrored else ())


def sensible_range(variable: Variable) -> tuple[float, float]:
    """Between which a block's bounds make sense at all, in SI units: as in a vehicle file; altitudes, within the atmosphere."""
    if variable.name in Bounds.model_fields:
        return range_of(variable.name)
    if f"lift_{variable.name}" in OF_BOTH_KINDS:
        return range_of(f"lift_{variable.name}")
    return {"rad/s": range_of("lift_rotor_speed"), "m": (LOWEST, HIGHEST)}[
        variable.unit
    ]  # speeds of a group; altitudes
