"""Where the lift rotors of a vehicle stand: mirrored pairs, and the booms that carry them."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lpc_mdo.config import Vehicle


CENTRED = 1e-6  # m from the plane of symmetry: what stands in it


def mirror_pairs(vehicle: "Vehicle") -> tuple[tuple[int, int], ...]:
    """Index pairs (port, starboard) of rotors that mirror each other in the plane y = 0; pushers may stand in it alone."""
    pairs = []
    for i, rotor in enumerate(vehicle.rotors):
        if rotor.kind == "pusher" and abs(rotor.hub[1]) <= CENTRED:
            continue
        twin = _twin(vehicle, i)
        if twin is None and rotor.kind == "pusher":
            raise ValueError(
                f"rotors[{i}].hub_m[1] = {rotor.hub[1]} is invalid: it must be 0, or {rotor.name!r} needs one mirror image with "
                "the opposite spin, of its group"
            )
        if twin is None:
            mirrored = [rotor.hub[0], -rotor.hub[1], rotor.hub[2]]
            raise ValueError(
                f"rotors: {rotor.name!r} needs one mirror image at hub_m = {mirrored} with the opposite spin, of its group"
            )
        if rotor.hub[1] < 0.0:
            pairs.append((i, twin))
    return tuple(pairs)


def _twin(vehicle: "Vehicle", i: int) -> int | None:
    """Index of the rotor that is the mirror image of another, if there is just one."""
    rotor = vehicle.rotors[i]
    mirrored = (rotor.hub[0], -rotor.hub[1], rotor.hub[2])
    twins = [j for j, other in enumerate(vehicle.rotors) if math.dist(other.hub, mirrored) < CENTRED and j != i]
    if len(twins) != 1:
        return None
    other = vehicle.rotors[twins[0]]
    return twins[0] if other.spin == -rotor.spin and other.group == rotor.group else None


def lift_pairs(vehicle: "Vehicle") -> tuple[tuple[int, int], ...]:
    """Those of the lift rotors."""
    return tuple(pair for pair in mirror_pairs(vehicle) if vehicle.rotors[pair[0]].kind == "lift")


def own_rotors(vehicle: "Vehicle") -> tuple[list[int], list[int]]:
    """Rotors that stand for all of a mirror-symmetric aircraft: those to port and in the middle, in the file's order.

    Returns their indices, and for every rotor of the file its place among them.
    """
    port_of = {starboard: port for port, starboard in mirror_pairs(vehicle)}
    own = [i for i in range(len(vehicle.rotors)) if i not in port_of]
    return own, [own.index(port_of.get(i, i)) for i in range(len(vehicle.rotors))]


@dataclass(frozen=True)
class Boom:
    """Indices (port, starboard) of the mirrored lift rotors ahead of the wing and behind it; None where there is none."""

    front: tuple[int, int] | None
    rear: tuple[int, int] | None

    @property
    def rotors(self) -> tuple[tuple[int, int], ...]:
        return tuple(pair for pair in (self.front, self.rear) if pair is not None)


def booms(vehicle: "Vehicle") -> tuple[Boom, ...]:
    """The booms of one side, outermost first: lift rotors at the same y share one, which crosses the wing there."""
    wing = vehicle.wing
    found: dict[float, dict[str, tuple[int, int] | None]] = {}
    for pair in lift_pairs(vehicle):
        x, y, _ = vehicle.lift_rotors[pair[0]].hub
        line = wing.root_quarter_chord[0] - y * math.tan(wing.quarter_chord_sweep)
        place = "front" if x < line else "rear"
        boom = found.setdefault(round(-y, 6), {"front": None, "rear": None})
        if (other := boom[place]) is not None:
            names = [vehicle.lift_rotors[rotor].name for rotor in (other[0], pair[0])]
            side = "ahead of" if place == "front" else "behind"
            raise ValueError(
                f"rotors[{pair[0]}].hub_m[0] = {x} is invalid: {names[0]!r} and {names[1]!r}, which share a boom, both lie {side} the "
                f"wing's quarter-chord line, x = {line:.4g} there; one of each boom must lie ahead of it and one behind"
            )
        boom[place] = pair
    return tuple(Boom(**found[y]) for y in sorted(found, reverse=True))
