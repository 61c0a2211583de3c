"""Where the lift rotors of a vehicle stand: mirrored pairs, and the booms that carry them."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lpc_mdo.config import Vehicle


def mirror_pairs(vehicle: "Vehicle") -> tuple[tuple[int, int], ...]:
    """Index pairs (port, starboard) of lift rotors that mirror each other in the plane y = 0."""
    pairs = []
    for i, port in enumerate(vehicle.lift_rotors):
        if port.hub[1] >= 0.0:
            continue
        mirrored = (port.hub[0], -port.hub[1], port.hub[2])
        twins = [j for j, other in enumerate(vehicle.lift_rotors) if math.dist(other.hub, mirrored) < 1e-6]
        if len(twins) != 1 or vehicle.lift_rotors[twins[0]].spin != -port.spin:
            raise ValueError(
                f"rotors: {port.name!r} needs one mirror image at hub_m = {list(mirrored)} with the opposite spin"
            )
        pairs.append((i, twins[0]))
    needed = len(vehicle.lift_rotors) // 2
    if len(pairs) != needed:
        raise ValueError(f"rotors: {len(pairs)} mirrored pairs of lift rotors are not allowed; there must be {needed}")
    return tuple(pairs)


def own_rotors(vehicle: "Vehicle") -> tuple[list[int], list[int]]:
    """Rotors that stand for all of a mirror-symmetric aircraft: the port lift rotors and the pusher, in the file's order.

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
    wing, found = vehicle.wing, {}
    for pair in mirror_pairs(vehicle):
        x, y, _ = vehicle.lift_rotors[pair[0]].hub
        place = "front" if x < wing.root_quarter_chord[0] - y * math.tan(wing.quarter_chord_sweep) else "rear"
        boom = found.setdefault(round(-y, 6), {"front": None, "rear": None})
        if boom[place] is not None:
            raise ValueError(
                f"rotors: {vehicle.lift_rotors[pair[0]].name!r} is not allowed; its boom has another {place} rotor"
            )
        boom[place] = pair
    return tuple(Boom(**found[y]) for y in sorted(found, reverse=True))
