"""Fuselage, half horizontal tail and fin as frames: geometry, mass and loads for given gauges.

Leading dimensions batch over samples; gauges come in, nothing is sized here.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.structures.airframe import FUSELAGE_CASES, SEA_LEVEL_DENSITY, Airframe, manoeuvre_load_factor
from lpc_mdo.structures.frame import BeamSections, FrameSolution, Topology, element_axes, solve_frame
from lpc_mdo.structures.pieces import Pieces, beam_rods, hat_lumps, join, nodal_loads, rods, supports
from lpc_mdo.structures.sections import BoxWalls, ShellWall
from lpc_mdo.surrogates.structural_mass import StructuralInputs

# Nodes and rings over the largest, at fractions of the length from the nose (ASSUMED: rounded nose, constant cabin, tail
# cone), and the bay of one wall that each element belongs to. The wing holds the fourth node.
STATIONS = (0.03, 0.10, 0.20, 0.282, 0.40, 0.50, 0.65, 0.80, 0.97)
RINGS = (0.35, 0.75, 1.0, 1.0, 1.0, 1.0, 0.80, 0.52, 0.20)
BAYS = (0, 0, 1, 2, 2, 3, 4, 4)
JOINT = 3
FLOOR = slice(1, 6)  # elements of the cabin
TAIL_PARTS = 4


def tail_force(airframe: Airframe, area: Tensor, speed: Tensor) -> Tensor:
    """Limit force (...,) N normal to a tail."""
    return airframe.tail_normal_force * 0.5 * SEA_LEVEL_DENSITY * speed**2 * area


@dataclass(frozen=True)
class Fuselage:
    """Elliptical shell on a straight axis; ends: walls at both ends (..., element, 2)."""

    airframe: Airframe
    points: Tensor
    topology: Topology
    ends: ShellWall
    sections: BeamSections
    length: Tensor

    def pieces(self) -> Pieces:
        a = self.airframe
        step, axes = element_axes(self.points, self.topology)
        shell = beam_rods(a.material.density, self.points, self.topology, self.sections)
        ends = self.points[..., self.topology.elements, :]
        frames = a.frame_mass_per_area * self.ends.perimeter.mean(-1) * step
        spread = (self.sections.second_moment_z, self.sections.second_moment_y)
        stiffening = rods(frames, ends, axes, *(moment / self.sections.area for moment in spread))
        width = 2.0 * a.half_width
        cabin = rods(
            a.floor_areal_mass * width * step[..., FLOOR],
            ends[..., FLOOR, :, :] - torch.tensor([0.0, 0.0, 0.5 * a.half_height], dtype=step.dtype),
            axes[..., FLOOR, :, :],
            torch.full_like(step[..., FLOOR], width**2 / 12.0),
            torch.zeros_like(step[..., FLOOR]),
        )
        return join(shell, stiffening, cabin)

    def _spread(self, x: Tensor) -> Tensor:
        """Weights (..., node) that put a force at x (...,) m on the neighbouring nodes, moments kept within the frame."""
        at = torch.tensor(STATIONS, dtype=x.dtype)
        share = (x - self.airframe.nose) / self.length
        passed = ((share[..., None] - at[:-1]) / (at[1:] - at[:-1])).clamp(0.0, 1.0)
        one, zero = torch.ones_like(passed[..., :1]), torch.zeros_like(passed[..., :1])
        return torch.cat([one, passed], dim=-1) - torch.cat([passed, zero], dim=-1)

    def loads(self, pieces: Pieces, inputs: StructuralInputs, gross_mass: Tensor) -> Tensor:
        """Limit loads (..., case, node, 6) of the cases FUSELAGE_CASES; the wing joint balances each. Sources as for the wing; crash: 14 CFR
        23.561(b), ultimate, here divided by the safety factor."""
        a, longer = self.airframe, self.length - self.airframe.baseline_length
        elements = self.topology.elements
        structure = pieces.mass[..., : 2 * len(elements)].unflatten(-1, (2, -1)).sum(-2)
        floor = torch.nn.functional.pad(
            pieces.mass[..., 2 * len(elements) :], (FLOOR.start, len(elements) - FLOOR.stop)
        )
        structure = 0.5 * (structure + floor)
        mass = torch.zeros(*structure.shape[:-1], len(STATIONS), dtype=structure.dtype)
        mass = mass.index_add(-1, elements[:, 0], structure).index_add(-1, elements[:, 1], structure)
        for item in a.items:
            mass = mass + item.mass * self._spread(item.x + item.slope * longer)
        mass = mass + inputs.battery_mass[..., None] * self._spread(a.battery_x + a.battery_slope * longer)
        limit = manoeuvre_load_factor(gross_mass)
        one = torch.ones_like(limit)
        up = torch.stack([limit, -0.4 * limit, 2.0 * one, 2.67 * one, one, one, -3.0 / a.safety_factor * one], dim=-1)
        ahead = (9.0 / a.safety_factor) * torch.tensor([case == "crash" for case in FUSELAGE_CASES], dtype=up.dtype)
        weight = mass[..., None, :] * GRAVITY
        cases = torch.eye(len(FUSELAGE_CASES), dtype=up.dtype)[..., None]
        gear = ((2.67 - 2.0 / 3.0) * gross_mass * GRAVITY)[..., None] * self._spread(a.gear_x + a.gear_slope * longer)
        tail = tail_force(a, inputs.horizontal_tail_area, inputs.cruise_speed)[..., None]
        fin = tail_force(a, inputs.vertical_tail_area, inputs.cruise_speed)[..., None]
        tail = tail * self._spread(torch.full_like(self.length, a.tail_root[0]))
        fin = fin * self._spread(torch.full_like(self.length, a.fin_root[0]))
        height = torch.sqrt(inputs.vertical_tail_area * a.fin_aspect_ratio)
        arm = (0.45 * height + a.fin_root[2] - self.points[..., 0, 2])[..., None]  # centroid of a tapered fin
        vertical = -weight * up[..., None] + gear[..., None, :] * cases[3] - tail[..., None, :] * cases[4]
        return nodal_loads(
            {
                0: -weight * ahead[:, None],
                1: fin[..., None, :] * cases[5],
                2: vertical,
                3: -(fin * arm)[..., None, :] * cases[5],
            }
        )

    def solve(self, loads: Tensor) -> FrameSolution:
        material = self.airframe.material
        return solve_frame(
            self.points, self.topology, self.sections, loads, material.elastic_modulus, material.shear_modulus
        )


def fuselage(airframe: Airframe, inputs: StructuralInputs, wall: Tensor) -> Fuselage:
    """Fuselage with walls (..., 5) m of nose, front cabin, middle, rear cabin and tail cone."""
    a, length = airframe, inputs.fuselage_length
    x = a.nose + length[..., None] * torch.tensor(STATIONS, dtype=length.dtype)
    # The axis is that of the cabin; the published nose and rear ends differ in height by 0.8 m, which the beam ignores.
    height = torch.full_like(x, a.cabin_axis_height)
    points = torch.stack([x, torch.zeros_like(x), height], dim=-1)
    count = len(BAYS)
    elements = torch.stack([torch.arange(count), torch.arange(1, count + 1)], dim=-1)
    up = torch.tensor([0.0, 0.0, 1.0], dtype=x.dtype).expand(count, 3)
    topology = Topology(elements, up, supports(count + 1, {JOINT: tuple(range(6))}))
    ring = torch.tensor(RINGS, dtype=x.dtype)[elements]
    walls = wall[..., list(BAYS)]
    ends = ShellWall(a.half_width * ring, a.half_height * ring, walls[..., None])
    middle = ShellWall(ends.semi_axis_y.mean(-1), ends.semi_axis_z.mean(-1), walls)
    return Fuselage(a, points, topology, ends, middle.constants(), length)


@dataclass(frozen=True)
class TailSurface:
    """A cantilever box along y (half the horizontal tail) or z (fin); box: walls at both ends (..., element, 2)."""

    airframe: Airframe
    points: Tensor
    topology: Topology
    box: BoxWalls
    sections: BeamSections
    chord: Tensor
    force: Tensor  # (...,) N at limit load
    is_upright: bool

    def pieces(self) -> Pieces:
        a = self.airframe
        step, axes = element_axes(self.points, self.topology)
        shell = beam_rods(a.material.density, self.points, self.topology, self.sections)
        chord = self.chord.mean(-1)
        width, height = a.box_width * chord, a.height_factor * a.tail_thickness_to_chord * chord
        ends = self.points[..., self.topology.elements, :]
        ribs = rods(
            a.material.density * a.rib_thickness * width * height / a.rib_pitch * step,
            ends,
            axes,
            width**2 / 12.0,
            height**2 / 12.0,
        )
        aft = (0.25 - a.box_offset) * chord[..., None, None] * torch.tensor([1.0, 0.0, 0.0], dtype=chord.dtype)
        skins = a.secondary_areal_mass * (chord - width) * step
        return join(shell, ribs, rods(skins, ends + aft, axes, chord**2 / 12.0, torch.zeros_like(chord)))

    def loads(self) -> Tensor:
        """Limit loads (..., 1 case, node, 6): the force in proportion to the chord at the quarter chord, one case; inertia relief is left out."""
        a, axis = self.airframe, 2 if self.is_upright else 1
        nodes = self.points[..., axis]
        chord = torch.cat([self.chord[..., :1, 0], self.chord[..., :, 1]], dim=-1)
        start, slope = nodes[..., :1, None], ((chord[..., -1] - chord[..., 0]) / (nodes[..., -1] - nodes[..., 0]))
        root = chord[..., 0, None, None]

        def local_chord(place: Tensor) -> Tensor:
            return root + slope[..., None, None] * (place - start)

        area = hat_lumps(nodes, local_chord)
        share = self.force[..., None] / area.sum(-1, keepdim=True)
        force = (share * area)[..., None, :]
        torque = (share * a.box_offset * hat_lumps(nodes, lambda y: local_chord(y) ** 2))[..., None, :]
        return nodal_loads({1: force, 5: -torque} if self.is_upright else {2: force, 4: torque})

    def solve(self, loads: Tensor) -> FrameSolution:
        material = self.airframe.material
        return solve_frame(
            self.points, self.topology, self.sections, loads, material.elastic_modulus, material.shear_modulus
        )


def _tail_surface(
    airframe: Airframe,
    root: tuple[float, float, float],
    reach: Tensor,
    root_chord: Tensor,
    taper: float,
    force: Tensor,
    skin: Tensor,
    is_upright: bool,
) -> TailSurface:
    place = torch.linspace(0.0, 1.0, TAIL_PARTS + 1, dtype=reach.dtype)
    chord = root_chord[..., None] * (1.0 - (1.0 - taper) * place)
    along = reach[..., None] * place
    zero = torch.zeros_like(along)
    x = root[0] + airframe.box_offset * chord
    points = torch.stack([x, zero + root[1], root[2] + along] if is_upright else [x, along, zero + root[2]], dim=-1)
    elements = torch.stack([torch.arange(TAIL_PARTS), torch.arange(1, TAIL_PARTS + 1)], dim=-1)
    up = torch.tensor([0.0, 1.0, 0.0] if is_upright else [0.0, 0.0, 1.0], dtype=x.dtype).expand(TAIL_PARTS, 3)
    topology = Topology(elements, up, supports(TAIL_PARTS + 1, {0: tuple(range(6))}))
    walls = skin[..., :1] + (skin[..., 1:] - skin[..., :1]) * place
    at_ends, walls = chord[..., elements], walls[..., elements]
    height = airframe.height_factor * airframe.tail_thickness_to_chord * at_ends
    box = BoxWalls(airframe.box_width * at_ends, height, walls, walls, torch.zeros_like(walls))
    middle = BoxWalls(*(getattr(box, name).mean(-1) for name in BoxWalls.__dataclass_fields__))
    return TailSurface(airframe, points, topology, box, middle.constants(), at_ends, force, is_upright)


def horizontal_tail(airframe: Airframe, inputs: StructuralInputs, skin: Tensor) -> TailSurface:
    """Starboard half with one wall for skins and webs, skin (..., 2) m at root and tip."""
    a, area = airframe, inputs.horizontal_tail_area
    b = torch.sqrt(area * a.tail_aspect_ratio)
    chord = 2.0 * area / (b * (1.0 + a.tail_taper))
    force = 0.5 * tail_force(a, area, inputs.cruise_speed)
    return _tail_surface(a, a.tail_root, 0.5 * b, chord, a.tail_taper, force, skin, False)


def fin(airframe: Airframe, inputs: StructuralInputs, skin: Tensor) -> TailSurface:
    """The fin with one wall for skins and webs, skin (..., 2) m at root and tip."""
    a, area = airframe, inputs.vertical_tail_area
    height = torch.sqrt(area * a.fin_aspect_ratio)
    chord = 2.0 * area / (height * (1.0 + a.fin_taper))
    return _tail_surface(
        a, a.fin_root, height, chord, a.fin_taper, tail_force(a, area, inputs.cruise_speed), skin, True
    )
