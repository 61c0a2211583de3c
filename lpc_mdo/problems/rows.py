"""The rows of the gross-weight problem: the published seventeen, for whatever rotors and segments there are."""

import math
from collections.abc import Callable
from itertools import pairwise

import torch
from torch import Tensor

from lpc_mdo.config import Battery, Vehicle
from lpc_mdo.config.layout import booms, mirror_pairs
from lpc_mdo.disciplines.equivalent_circuit import SUSTAINED_SHARE
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.schedule import Schedule, altitude_name, end_altitude_name, speed_name
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.envelope_rows import envelope_rows
from lpc_mdo.problems.problem import Constraint
from lpc_mdo.problems.variables import free_ends

TRANSITION_LIFT_SHARE = 1.0 / 1.2**2


def gross_weight_rows(schedule: Schedule) -> tuple[Constraint[Analysis], ...]:
    """In the order of the published table."""
    vehicle, limits = schedule.vehicle, schedule.mission.requirements
    pairs, rotors = mirror_pairs(vehicle), vehicle.rotors
    return (
        Constraint("trim_residual", "1", imposed_trim(schedule), lower=0.0, upper=0.0, scale=0.1),
        Constraint(
            "final_state_of_charge",
            "1",
            lambda a: present(a.energy, "energy").battery.final_state_of_charge,
            lower=limits.minimum_final_state_of_charge,
            scale=0.1,
            limits_within=(0.0, 1.0),
        ),
        stall_row(schedule),
        *wing_lift_rows(schedule),
        *altitude_rows(schedule),
        Constraint(
            "sound_pressure_level",
            "dB(A)",
            lambda a: a.observed_dba,
            upper=limits.maximum_sound_pressure_level,
            scale=3.0,
            limits_within=(0.0, 140.0),
        ),
        *(
            Constraint(
                f"rotor_symmetry_{rotors[i].name}", "1", rotor_symmetry(schedule, i, j), 0.0, 0.0, only_equates=True
            )
            for i, j in pairs
        ),
        *tip_clearances(vehicle, limits.rotor_tip_clearance, vehicle.bounds.lift_rotor_radius.upper),
        *(torque_row(schedule, name) for name in schedule.mission.torque_segments if schedule.in_segment(name)),
        *(
            Constraint(f"motor_symmetry_{rotors[i].name}", "1", motor_symmetry(i, j), 0.0, 0.0, only_equates=True)
            for i, j in pairs
        ),
        *(battery_limits(vehicle.battery) if vehicle.battery.model == "equivalent_circuit" else ()),
        *envelope_rows(schedule),
    )


def imposed_trim(schedule: Schedule) -> Callable[[Analysis], Tensor]:
    """The components of the scaled trim residual that symmetry does not settle, segment by segment; to impose the others would
    repeat rows.

    In hover the longitudinal force is zero for vertical rotors, and all lateral components vanish by the symmetry of the vehicle file
    and the symmetry rows, but the reaction to a single pusher's torque: the result reports it, and ailerons are assumed to hold it.
    """
    places = [6 * i + k for i, segment in enumerate(schedule.segments) for k in segment.imposed]
    index = torch.tensor(places)

    def imposed(a: Analysis) -> Tensor:
        return a.scaled_trim.flatten(-2)[..., index]

    return imposed


def stall_row(schedule: Schedule) -> Constraint[Analysis]:
    """Stall speeds against the speed flown; where speeds differ, the margin in each segment."""
    mission = schedule.mission
    names = [name for name in schedule.wingborne_names if mission.segment(name).is_steady]
    speeds, margin = [mission.speed(name) for name in names], mission.requirements.stall_margin
    if len(set(speeds)) > 1:
        return stall_margin_row(schedule)
    index = torch.tensor([schedule.wingborne_index(name) for name in names])
    return Constraint(
        "stall_speed",
        "m/s",
        lambda a: a.aerodynamics.stall_speed[..., index],
        upper=speeds[0] - margin,
        scale=10.0,
        limits_within=(0.0, speeds[0]),
    )


def stall_margin_row(schedule: Schedule) -> Constraint[Analysis]:
    """Speed flown less stall speed (..., steady segment on the wing)."""
    names = [name for name in schedule.wingborne_names if schedule.mission.segment(name).is_steady]
    index = torch.tensor([schedule.segment_index(name) for name in names])
    place = torch.tensor([schedule.wingborne_index(name) for name in names])
    return Constraint(
        "stall_margin",
        "m/s",
        lambda a: a.flight.speed[..., index] - a.aerodynamics.stall_speed[..., place],
        lower=schedule.mission.requirements.stall_margin,
        scale=10.0,
    )


def wing_lift_rows(schedule: Schedule) -> list[Constraint[Analysis]]:
    """Share of the wing's largest lift coefficient, where lift does not equal the weight: in a transition as far below stall as at 1.2
    times its speed (rule of starbelt/evtolpy for the end of a transition), at a positive load factor up to it.

    Stall at negative angles is not modelled: no row guards it.
    """
    found = []
    for i, name in enumerate(schedule.wingborne_names):
        segment = schedule.mission.segment(name)
        if segment.is_steady or segment.load_factor < 0.0:
            continue
        limit = 1.0 if segment.load_factor > 1.0 else TRANSITION_LIFT_SHARE
        found.append(
            Constraint(f"wing_lift_{name}", "1", wing_lift_share(i), upper=limit, scale=0.3, limits_within=(0.0, 1.0))
        )
    return found


def wing_lift_share(place: int) -> Callable[[Analysis], Tensor]:
    """Lift coefficient over the largest, at a place along `wingborne`."""

    def share(a: Analysis) -> Tensor:
        aero = present(a.aerodynamics, "aerodynamics")
        return aero.lift_coefficient[..., place] / aero.maximum_lift_coefficient[..., place]

    return share


def altitude_rows(schedule: Schedule) -> list[Constraint[Analysis]]:
    """Climbs end where the next segment flies."""
    ends = free_ends(schedule)

    def row(climb: str, level: str) -> Constraint[Analysis]:
        top, altitude = end_altitude_name(climb), altitude_name(level)
        return Constraint(
            "altitude_match" if len(ends) == 1 else f"altitude_match_{climb}",
            "m",
            lambda a: a.design.of_segments[top] - a.design.of_segments[altitude],
            0.0,
            0.0,
            scale=50.0,
            only_equates=True,
        )

    return [row(climb, level) for climb, level in ends]


def torque_row(schedule: Schedule, segment: str) -> Constraint[Analysis]:
    """Share of their largest torque that the motors of a segment give; of mirrored ones, which are equal, the one to port."""
    points = torch.tensor([k for k in schedule.in_segment(segment) if k in schedule.own_points])
    return Constraint(
        f"motor_torque_{segment}",
        "1",
        lambda a: a.propulsion.torque_share[..., points],
        upper=1.0 - schedule.mission.requirements.torque_margin,
        scale=0.3,
        limits_within=(0.0, 1.0),
    )


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


def rotor_symmetry(schedule: Schedule, port: int, starboard: int) -> Callable[[Analysis], Tensor]:
    """Differences between two rotors (..., 8): radius, chord, twist and speeds, over lengths and speeds of their size."""
    group = schedule.vehicle.rotors[port].group
    points = [schedule.points[k] for k in schedule.of_group(group)]
    rotors = [point.rotor if schedule.is_symmetric(point) else None for point in points]
    ports, starboards = ([k for k, rotor in enumerate(rotors) if rotor == one] for one in (port, starboard))

    def difference(a: Analysis) -> Tensor:
        d = a.design
        parts = [
            (d.rotor_radius[..., port] - d.rotor_radius[..., starboard])[..., None],
            (d.blade_chord[..., port, :] - d.blade_chord[..., starboard, :]) / 0.2,
            (d.blade_twist[..., port, :] - d.blade_twist[..., starboard, :]) / 0.5,
        ]
        if ports:
            speeds = d.of_segments[speed_name(group)]
            parts.append((speeds[..., ports] - speeds[..., starboards]) / 50.0)
        return torch.cat(parts, dim=-1)

    return difference


def motor_symmetry(port: int, starboard: int) -> Callable[[Analysis], Tensor]:
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
                name,
                "m",
                tip_clearance(one, other, axis),
                lower=least,
                scale=0.3,
                limits_within=(0.0, math.inf),
                is_two_sided=True,
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


def tip_clearance(one: tuple[int, int], other: tuple[int, int], axis: int) -> Callable[[Analysis], Tensor]:
    """Gap (..., 2) m along an axis between the tips of two rotors, port and starboard; indices (port, starboard)."""
    first, second = torch.tensor(one), torch.tensor(other)

    def gap(a: Analysis) -> Tensor:
        hubs, radius = a.shape.hubs, a.design.rotor_radius
        distance = (hubs[..., first, axis] - hubs[..., second, axis]).abs()
        return distance - radius[..., first] - radius[..., second]

    return gap
