"""Rows that a mission may ask for beyond the published ones: what keeps an aircraft from stalling its blades or striking itself."""

from collections.abc import Callable

import torch
from torch import Tensor

from lpc_mdo.config.layout import own_rotors
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.problems.problem import Constraint

OUTER_SPAN = 0.5  # of the blade, from where its angle of attack is limited: inboard sections carry little
SHARPNESS = 200.0  # 1/rad of the smooth maximum along a blade, which exceeds the true one by up to log(stations)/SHARPNESS, 0.8 degrees


def envelope_rows(schedule: Schedule) -> list[Constraint[Analysis]]:
    """Those whose limit the mission's requirements give."""
    limits, rows = schedule.mission.requirements, []
    if limits.maximum_tip_mach is not None:
        points = torch.tensor(schedule.own_points)
        rows.append(_row("tip_mach", "1", tip_mach, limits.maximum_tip_mach, 0.1, points))
    if limits.maximum_blade_angle_of_attack is not None:
        rows.append(
            _row(
                "blade_angle_of_attack",
                "rad",
                outer_angle_of_attack,
                limits.maximum_blade_angle_of_attack,
                0.1,
                _lifting(schedule, is_edgewise=False),
            )
        )
    if limits.maximum_blade_loading is not None and bool(schedule.is_edgewise.any()):
        points = _lifting(schedule, is_edgewise=True)
        rows.append(_row("blade_loading", "1", blade_loading, limits.maximum_blade_loading, 0.05, points))
    if limits.fuselage_clearance is not None:
        rows += fuselage_clearances(schedule, limits.fuselage_clearance)
    return rows


def tip_mach(a: Analysis) -> Tensor:
    """(..., point) of the blades' turning and of the flow along or across the disk, whichever way it adds."""
    loads, segment = a.rotors.loads, a.schedule.segment
    across = torch.where(a.schedule.is_edgewise, a.flight.speed[..., segment], 0.0)
    tip = loads.inflow.rotation_speed * loads.rotor.radius + across
    return torch.hypot(tip, loads.inflow.axial_velocity) / loads.inflow.speed_of_sound


def outer_angle_of_attack(a: Analysis) -> Tensor:
    """(..., point) rad: smooth maximum along the outer blade."""
    angle = a.rotors.loads.angle_of_attack
    outer = angle[..., int(OUTER_SPAN * angle.shape[-1]) :]
    return torch.logsumexp(SHARPNESS * outer, dim=-1) / SHARPNESS


def blade_loading(a: Analysis) -> Tensor:
    """(..., point) thrust over density, blade area and squared tip speed."""
    loads = a.rotors.loads
    tip_speed = loads.inflow.rotation_speed * loads.rotor.radius
    return loads.thrust / (loads.inflow.density * loads.blade_area * tip_speed**2)


def fuselage_clearances(schedule: Schedule, least: float) -> list[Constraint[Analysis]]:
    """Gap between the blade tips of each lift rotor to port whose disk lies beside the fuselage, and the fuselage's side."""
    vehicle, rows = schedule.vehicle, []
    nose, rear = vehicle.fuselage.nose[0], vehicle.fuselage.rear[0]
    for i in own_rotors(vehicle)[0]:
        rotor, largest = vehicle.rotors[i], vehicle.bounds.lift_rotor_radius.upper
        if rotor.kind != "lift" or not nose - largest < rotor.hub[0] < rear + largest:
            continue
        if abs(rotor.hub[1]) - largest - 0.5 * vehicle.fuselage.width > least + MOTION:
            continue

        def gap(a: Analysis, i: int = i) -> Tensor:
            return a.shape.hubs[..., i, 1].abs() - a.design.rotor_radius[..., i] - 0.5 * vehicle.fuselage.width

        rows.append(Constraint(f"fuselage_clearance_{rotor.name}", "m", gap, lower=least, scale=0.3))
    return rows


MOTION = 1.0  # m that a hub may move inboard with the wing's span: rotors farther out need no row


def _lifting(schedule: Schedule, is_edgewise: bool) -> Tensor:
    """Points of lift rotors, flown on the wing or not, that are no mirror image of another."""
    is_there = ~schedule.is_propelling & (schedule.is_edgewise == is_edgewise)
    return torch.tensor([k for k in schedule.own_points if is_there[k]])


def _row(
    name: str, unit: str, of: Callable[[Analysis], Tensor], upper: float, scale: float, points: Tensor
) -> Constraint[Analysis]:
    return Constraint(name, unit, lambda a: of(a)[..., points], upper=upper, scale=scale)
