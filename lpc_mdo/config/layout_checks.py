"""Layouts that nobody could build are refused where the vehicle file is read: symmetry, order along the body, enclosure.

The model takes these for granted: only one half is designed, trim is longitudinal, masses ride in the body, and booms join
hubs to the wing. A check asks for no more than that, so that unusual aircraft pass; layout_limits.py says what is allowed for.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from lpc_mdo.config import layout_limits as limits
from lpc_mdo.config.layout import CENTRED
from lpc_mdo.config.layout_parts import Fault, axis_height, fin_top, half_span, root_edges
from lpc_mdo.config.layout_rotors import check_pairs, check_rotors

if TYPE_CHECKING:
    from lpc_mdo.config import Vehicle
    from lpc_mdo.config.vehicle import DragArea, FixedMass, StudyDrag

ON_TAIL, IN_BODY = "the body or the fin, which carry the tail", "the body, in which the battery rides"


def require_buildable(vehicle: "Vehicle") -> None:
    """Raises ValueError with the first fault of a vehicle whose rotors come in mirrored pairs."""
    for check in (check_pairs, _symmetry, _order, _sizes, _enclosure, check_rotors, _masses):
        for fault in check(vehicle):
            raise ValueError(str(fault))


def _symmetry(vehicle: "Vehicle") -> Iterator[Fault]:
    places = {
        "wing.root_quarter_chord_m": vehicle.wing.root_quarter_chord,
        "horizontal_tail.root_quarter_chord_m": vehicle.horizontal_tail.root_quarter_chord,
        "vertical_tail.root_quarter_chord_m": vehicle.vertical_tail.root_quarter_chord,
        "fuselage.nose_m": vehicle.fuselage.nose,
        "fuselage.rear_m": vehicle.fuselage.rear,
        "battery.position_m": vehicle.battery.position,
        "drag.study.position_m": vehicle.drag.study.position,
    }
    for key, point in places.items():
        if abs(point[1]) > CENTRED:
            yield Fault(f"{key}[1]", point[1], "be 0: it stands in the plane of symmetry")
    for key, weights, points in (
        ("fixed_masses", [m.mass for m in vehicle.fixed_masses], [m.position for m in vehicle.fixed_masses]),
        ("drag.areas", [a.area for a in vehicle.drag.areas], [a.position for a in vehicle.drag.areas]),
    ):
        total = sum(weights)
        y = sum(w * p[1] for w, p in zip(weights, points, strict=True)) / total if total > 0.0 else 0.0
        if abs(y) > limits.BALANCED:
            worst = max(range(len(points)), key=lambda i: abs(weights[i] * points[i][1]))
            yield Fault(
                f"{key}[{worst}].position_m[1]",
                points[worst][1],
                f"be balanced to the other side: the common centre of {key} lies at y = {y:.3g} m, where only ailerons, "
                "which are not modelled, would hold it",
            )


def _order(vehicle: "Vehicle") -> Iterator[Fault]:
    """Along x, which points aft."""
    body = vehicle.fuselage
    if body.rear[0] <= body.nose[0]:
        yield Fault("fuselage.rear_m[0]", body.rear[0], f"lie behind nose_m[0] = {body.nose[0]}: x points aft")
    apart = math.dist(body.nose, body.rear)
    if abs(apart - body.length) > limits.LENGTH_AGREES * body.length:
        yield Fault(
            "fuselage.length_m",
            body.length,
            f"agree with nose_m and rear_m, which lie {apart:.4g} m apart, to {limits.LENGTH_AGREES:.0%}",
        )
    trailing = root_edges(vehicle.wing)[1]
    for name, surface in (("horizontal_tail", vehicle.horizontal_tail), ("vertical_tail", vehicle.vertical_tail)):
        leading = root_edges(surface)[0]
        if leading < trailing:
            yield Fault(
                f"{name}.root_quarter_chord_m[0]",
                surface.root_quarter_chord[0],
                f"lie farther aft: its leading edge, x = {leading:.4g} m, is not behind the wing's trailing edge, "
                f"x = {trailing:.4g} m",
            )
    for i, rotor in enumerate(vehicle.rotors):
        if rotor.kind == "pusher" and abs(rotor.hub[1]) > half_span(vehicle.wing):
            yield Fault(
                f"rotors[{i}].hub_m[1]",
                rotor.hub[1],
                f"lie within the wing's half span, {half_span(vehicle.wing):.4g} m, which carries pushers beside the body",
            )
        if rotor.kind == "pusher" and rotor.hub[0] < trailing:
            yield Fault(
                f"rotors[{i}].hub_m[0]",
                rotor.hub[0],
                f"lie behind the wing's trailing edge, x = {trailing:.4g} m: it pushes",
            )


def _enclosure(vehicle: "Vehicle") -> Iterator[Fault]:
    """Wing, tails, pusher and battery belong to the body, everything else to the aircraft's box."""
    body, fin, tail = vehicle.fuselage, vehicle.vertical_tail, vehicle.horizontal_tail
    nose, rear, height = body.nose[0], body.rear[0], body.height
    last = rear + limits.OVERHANG * body.length
    fin_aft = rear + fin.root_quarter_chord[0] - root_edges(fin)[0]  # its root begins on the body
    pushers = [(f"rotors[{i}].hub_m", rotor.hub) for i, rotor in enumerate(vehicle.rotors) if rotor.kind == "pusher"]
    for key, point, aft, top, what in (
        ("wing.root_quarter_chord_m", vehicle.wing.root_quarter_chord, rear, 0.0, "the body, which carries the wing"),
        ("horizontal_tail.root_quarter_chord_m", tail.root_quarter_chord, last, fin_top(fin), ON_TAIL),
        ("vertical_tail.root_quarter_chord_m", fin.root_quarter_chord, fin_aft, 0.0, "the body, which carries the fin"),
        *((key, hub, last, fin_top(fin), "the body or the fin, which carry the pusher") for key, hub in pushers),
        ("battery.position_m", vehicle.battery.position, rear, 0.0, IN_BODY),
    ):
        x, _, z = point
        if not nose <= x <= aft:
            yield Fault(f"{key}[0]", x, f"lie between {nose:.4g} and {aft:.4g}, along {what}")
        low, high = axis_height(body, x) - height, max(axis_height(body, x) + height, top)
        if not low <= z <= high:
            yield Fault(f"{key}[2]", z, f"lie between {low:.4g} and {high:.4g} at this x, at {what}")
    for name, (first, aft, what) in stations(vehicle).items():
        bound = getattr(vehicle.bounds, name)
        for side, x in (("lower", bound.lower), ("upper", bound.upper)):
            if not first <= x <= aft:
                yield Fault(f"bounds.{name}_m.{side}", x, f"lie between {first:.4g} and {aft:.4g}, along {what}")
    yield from _inside_box(vehicle)


def stations(vehicle: "Vehicle") -> dict[str, tuple[float, float, str]]:
    """Of what an optimization moves along the body: the first and the last x, m, and what lies there; by design variable."""
    body, tail = vehicle.fuselage, vehicle.horizontal_tail
    behind_wing = root_edges(vehicle.wing)[1] + tail.root_quarter_chord[0] - root_edges(tail)[0]
    return {
        "tail_position": (behind_wing, body.rear[0] + limits.OVERHANG * body.length, f"{ON_TAIL}, behind the wing"),
        "battery_position": (body.nose[0], body.rear[0], IN_BODY),
    }


def _inside_box(vehicle: "Vehicle") -> Iterator[Fault]:
    """No mass or drag area lies beyond every part of the aircraft."""
    body, fin, hubs = vehicle.fuselage, vehicle.vertical_tail, [rotor.hub for rotor in vehicle.rotors]
    aft = [body.rear[0], root_edges(vehicle.horizontal_tail)[1], root_edges(fin)[1], *(hub[0] for hub in hubs)]
    roof, wing = max(body.nose[2], body.rear[2]) + 0.5 * body.height, vehicle.wing.root_quarter_chord[2]
    low = (
        min(body.nose[0], *(hub[0] for hub in hubs)),
        -half_span(vehicle.wing),
        body.nose[2] - limits.BELOW_NOSE * body.height,
    )
    high = (max(aft), half_span(vehicle.wing), max(roof, wing, fin_top(fin), *(hub[2] for hub in hubs)))
    items: list[tuple[str, FixedMass | DragArea | StudyDrag]] = [
        (f"fixed_masses[{i}]", item) for i, item in enumerate(vehicle.fixed_masses)
    ]
    items += [(f"drag.areas[{i}]", item) for i, item in enumerate(vehicle.drag.areas)]
    for key, item in [*items, ("drag.study", vehicle.drag.study)]:
        for k, value in enumerate(item.position):
            if not low[k] <= value <= high[k]:
                what = f"{item.name!r} is a part" if hasattr(item, "name") else "it acts within the box"
                yield Fault(
                    f"{key}.position_m[{k}]",
                    value,
                    f"lie between {low[k]:.4g} and {high[k]:.4g}: {what} of the aircraft",
                )


def _sizes(vehicle: "Vehicle") -> Iterator[Fault]:
    """No part dwarfs what carries it."""
    body, wing, booms = vehicle.fuselage, vehicle.wing.area, vehicle.booms
    blade = min(rotor.radius for rotor in vehicle.lift_rotors)
    drag, side = sum(item.area for item in vehicle.drag.areas), min(body.width, body.height)
    for key, value, most, what in (
        ("horizontal_tail.area_m2", vehicle.horizontal_tail.area, limits.LARGEST_TAIL * wing, "the wing's area"),
        ("vertical_tail.area_m2", vehicle.vertical_tail.area, limits.LARGEST_FIN * wing, "half the wing's area"),
        ("drag.study.area_m2", vehicle.drag.study.area, limits.LARGEST_DRAG * wing, "a quarter of the wing's area"),
        ("drag.areas[0].area_m2", drag, limits.LARGEST_DRAG * wing, "a quarter of the wing's area, all areas together"),
        ("fuselage.height_m", body.height, limits.STOUTEST * body.length, "half its length"),
        ("fuselage.width_m", body.width, limits.STOUTEST * body.length, "half its length"),
        ("booms.diameter_m", booms.diameter, limits.THICKEST_BOOM * side, "half the fuselage's width or height"),
        ("booms.overhang_m", booms.overhang, limits.LONGEST_STUB * blade, "the lift rotors' radius"),
    ):
        if value > most:
            yield Fault(key, f"{value:g}", f"be at most {most:.4g}, {what}")


def _masses(vehicle: "Vehicle") -> Iterator[Fault]:
    total = sum(item.mass for item in vehicle.fixed_masses)
    if total < limits.LEAST_LOAD * vehicle.battery.mass:
        yield Fault(
            "fixed_masses[0].mass_kg",
            vehicle.fixed_masses[0].mass,
            f"be more: all fixed masses together are {total:g} kg, and payload, gear and systems weigh at least "
            f"{limits.LEAST_LOAD:.0%} of the battery",
        )
