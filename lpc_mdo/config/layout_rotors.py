"""Rotors that nobody could build: pairs that are no mirror images, disks that cut through each other, the body or a tail."""

import math
from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING, Any

from lpc_mdo.config import layout_limits as limits
from lpc_mdo.config.layout import mirror_pairs
from lpc_mdo.config.layout_parts import Fault, axis_height, fin_top, half_span, root_edges
from lpc_mdo.files.faults import shortened

if TYPE_CHECKING:
    from lpc_mdo.config import RotorSpecification, Vehicle

SAME_OF_PAIRS = ("radius", "root_cutout", "blades", "airfoil", "chord", "twist", "speed")


def check_pairs(vehicle: "Vehicle") -> Iterator[Fault]:
    """Two rotors that mirror each other must be one design: another would roll the aircraft, and no row trims that."""
    for i, j in mirror_pairs(vehicle):
        port, starboard = vehicle.rotors[i], vehicle.rotors[j]
        for name in SAME_OF_PAIRS:
            if getattr(port, name) != getattr(starboard, name):
                key, (own, other) = _in_file_units(name, getattr(port, name), getattr(starboard, name))
                yield Fault(
                    f"rotors[{i}].{key}",
                    own,
                    f"be {other}, that of rotors[{j}]: {port.name!r} and {starboard.name!r} mirror each other, and may "
                    "differ in name, spin and side alone",
                )


def _in_file_units(name: str, *values: Any) -> tuple[str, list[object]]:
    """The key of a rotor's field in a file, and values as they stand there."""
    unit, factor = {
        "radius": ("_m", 1.0),
        "chord": ("_m", 1.0),
        "twist": ("_deg", 180.0 / math.pi),
        "speed": ("_rpm", 30.0 / math.pi),
    }.get(name, ("", None))
    if name == "airfoil":
        return name, [shortened(s[0][0] if len(s) == 1 else [list(pair) for pair in s]) for s in values]
    if factor is None:
        return name, list(values)
    return name + unit, [
        [float(f"{v * factor:.7g}") for v in value] if isinstance(value, tuple) else float(f"{value * factor:.7g}")
        for value in values
    ]


def check_rotors(vehicle: "Vehicle") -> Iterator[Fault]:
    wing, body = vehicle.wing, vehicle.fuselage
    reach = half_span(wing)
    lift = list(enumerate(vehicle.lift_rotors))
    for i, rotor in enumerate(vehicle.rotors):
        if max(rotor.chord) > rotor.radius:
            yield Fault(f"rotors[{i}].chord_m", list(rotor.chord), f"be below radius_m = {rotor.radius}")
    for i, rotor in lift:
        x, y, z = rotor.hub
        if abs(y) > reach:
            yield Fault(
                f"rotors[{i}].hub_m[1]",
                y,
                f"lie within the wing's half span, {reach:.4g} m: the boom of {rotor.name!r} crosses the wing there "
                f"(wing.area_m2 = {wing.area}, aspect_ratio = {wing.aspect_ratio})",
            )
        line = wing.root_quarter_chord
        across = abs(x - line[0] - abs(y) * math.tan(wing.quarter_chord_sweep))
        over = z - line[2] - abs(y) * math.tan(wing.dihedral)
        if across > body.length:
            yield Fault(f"rotors[{i}].hub_m[0]", x, f"lie within {body.length:g} m, the fuselage's length, of the wing")
        if abs(over) > max(across, limits.STEEP):
            yield Fault(
                f"rotors[{i}].hub_m[2]",
                z,
                f"lie no farther above or below the wing than ahead of or behind it ({across:.3g} m, or {limits.STEEP:g}): a boom "
                "joins them",
            )
        yield from _free_of_body(vehicle, i, rotor)
    for (i, one), (j, other) in combinations(lift, 2):
        apart, radii = math.dist(one.hub[:2], other.hub[:2]), one.radius + other.radius
        if apart < (1.0 - limits.OVERLAP) * radii:
            yield _overlap(i, one, j, apart, radii)
    yield from _free_pushers(vehicle)
    for i, rotor in enumerate(vehicle.rotors):
        if (tip := rotor.speed * rotor.radius) >= limits.SOUND:
            value = float(f"{rotor.speed * 30.0 / math.pi:.7g}")
            yield Fault(
                f"rotors[{i}].speed_rpm", value, f"be lower: the blade's tip turns at {tip:.4g} m/s, faster than sound"
            )


def _free_of_body(vehicle: "Vehicle", i: int, rotor: "RotorSpecification") -> Iterator[Fault]:
    """A disk at the height of the body must end beside it, or ahead of it, or behind."""
    body, (x, y, z) = vehicle.fuselage, rotor.hub
    reach = (1.0 - limits.OVERLAP) * rotor.radius
    is_along = body.nose[0] <= x + reach and x - reach <= body.rear[0]
    if is_along and abs(z - axis_height(body, x)) < 0.5 * body.height and abs(y) - reach < 0.5 * body.width:
        yield Fault(
            f"rotors[{i}].radius_m",
            rotor.radius,
            f"be below {abs(y) - 0.5 * body.width:.4g}, the distance of its hub from the fuselage's side",
        )


def _free_pushers(vehicle: "Vehicle") -> Iterator[Fault]:
    """A disk that stands upright must cut through no body, tail or other pusher."""
    body, tail, fin = vehicle.fuselage, vehicle.horizontal_tail, vehicle.vertical_tail
    root, fin_root = tail.root_quarter_chord, fin.root_quarter_chord
    pushers = [(i, rotor) for i, rotor in enumerate(vehicle.rotors) if rotor.kind == "pusher"]
    for i, rotor in pushers:
        x, y, z = rotor.hub
        for name, (front, back), across, up in (
            ("fuselage", (body.nose[0], body.rear[0]), y, z - axis_height(body, x)),
            ("horizontal_tail", root_edges(tail), max(abs(y) - half_span(tail), 0.0), z - root[2]),
            ("vertical_tail", root_edges(fin), y, z - min(max(z, fin_root[2]), fin_top(fin))),
        ):
            if front <= x <= back and math.hypot(across, up) < (1.0 - limits.OVERLAP) * rotor.radius:
                yield Fault(
                    f"rotors[{i}].hub_m[0]",
                    x,
                    f"lie before {front:.4g} or behind {back:.4g}: between them its blades cut through the {name}",
                )
    for (i, one), (j, other) in combinations(pushers, 2):
        apart, radii = math.dist(one.hub[1:], other.hub[1:]), one.radius + other.radius
        is_beside = abs(one.hub[0] - other.hub[0]) < max(*one.chord, *other.chord)
        if is_beside and apart < (1.0 - limits.OVERLAP) * radii:
            yield _overlap(i, one, j, apart, radii)


def _overlap(i: int, rotor: "RotorSpecification", j: int, apart: float, radii: float) -> Fault:
    rule = f"be smaller: with that of rotors[{j}] it makes {radii:.4g} m, and the hubs are {apart:.4g} m apart"
    return Fault(f"rotors[{i}].radius_m", rotor.radius, rule)
