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
    for i, port in enumerate(vehicle.rotors):
        if port.hub[1] >= -CENTRED:
            continue
        mirrored = (port.hub[0], -port.hub[1], port.hub[2])
        twins = [j for j, other in enumerate(vehicle.rotors) if math.dist(other.hub, mirrored) < CENTRED]
        if (
            len(twins) != 1
            or vehicle.rotors[twins[0]].spin != -port.spin
            or vehicle.rotors[twins[0]].group != port.group
        ):
            raise ValueError(
                f"rotors: {port.name!r} needs one mirror image at hub_m = {list(mirrored)} with the opposite spin, of its group"
            )
        pairs.append((i, twins[0]))
    for kind in ("lift", "pusher"):
        of_kind = [i for i, rotor in enumerate(vehicle.rotors) if rotor.kind == kind]
        alone = [i for i in of_kind if kind == "pusher" and abs(vehicle.rotors[i].hub[1]) <= CENTRED]
        found, needed = sum(port in of_kind for port, _ in pairs), (len(of_kind) - len(alone)) // 2
        if found != needed or (len(of_kind) - len(alone)) % 2:
            raise ValueError(f"rotors: {found} mirrored pairs of {kind} rotors are not allowed; there must be {needed}")
    return tuple(pairs)


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
    wing, found = vehicle.wing, {}
    for pair in lift_pairs(vehicle):
        x, y, _ = vehicle.lift_rotors[pair[0]].hub
        place = "front" if x < wing.root_quarter_chord[0] - y * math.tan(wing.quarter_chord_sweep) else "rear"
        boom = found.setdefault(round(-y, 6), {"front": None, "rear": None})
        if boom[place] is not None:
            raise ValueError(
                f"rotors: {vehicle.lift_rotors[pair[0]].name!r} is not allowed; its boom has another {place} rotor"
            )
        boom[place] = pair
    return tuple(Boom(**found[y]) for y in sorted(found, reverse=True))
