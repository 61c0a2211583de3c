"""The starboard half of wing and booms as a frame: geometry, mass and loads for given gauges.

Leading dimensions batch over samples; gauges come in, nothing is sized here.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.structures.airframe import Airframe, WingLoads, rotor_mass, rotor_torque, span
from lpc_mdo.structures.frame import BeamSections, FrameSolution, Topology, element_axes, solve_frame, subdivide
from lpc_mdo.structures.pieces import Pieces, beam_rods, hat_lumps, join, nodal_loads, rods, supports
from lpc_mdo.structures.sections import BoxWalls, ShellWall
from lpc_mdo.surrogates.structural_mass import StructuralInputs

# Points: centre, fuselage side, inner and outer boom, tip, then the four hubs. Segments: four of the wing, then front and
# rear half of the inner and of the outer boom.
SEGMENTS = torch.tensor([[0, 1], [1, 2], [2, 3], [3, 4], [2, 5], [2, 6], [3, 7], [3, 8]])
PARTS = (1, 3, 4, 3, 2, 2, 2, 2)
TIP, HUBS = 4, [5, 6, 7, 8]
BOOMS = ("boom_inner", "boom_outer")


@dataclass(frozen=True)
class Wing:
    """Starboard half of wing and booms. box: walls at both ends (..., element, 2) of the wing elements, which come first;
    tube: walls (..., element) of the boom elements; chord: (..., element, 2); overhang (..., 4) m beyond each hub."""

    airframe: Airframe
    points: Tensor
    topology: Topology
    box: BoxWalls
    tube: ShellWall
    sections: BeamSections
    chord: Tensor
    semi_span: Tensor
    area: Tensor
    overhang: Tensor

    @property
    def spanwise(self) -> int:
        """Number of wing elements."""
        return self.chord.shape[-2]

    @property
    def chain(self) -> Tensor:
        """Wing nodes from centre to tip."""
        elements = self.topology.elements[: self.spanwise]
        return torch.cat([elements[:1, 0], elements[:, 1]])

    def pieces(self) -> dict[str, Pieces]:
        """Starboard pieces of wing, inner and outer boom, in element order; the last two of a boom are its overhangs."""
        a, n = self.airframe, self.spanwise
        density = a.material.density
        beams = beam_rods(density, self.points, self.topology, self.sections)
        length, axes = element_axes(self.points, self.topology)
        chord = self.chord.mean(-1)
        box_width, box_height = a.box_width * chord, a.height_factor * a.thickness_to_chord * chord
        ribs = density * a.rib_thickness * box_width * box_height / a.rib_pitch
        skins = a.secondary_areal_mass * (chord - box_width)
        ends = self.points[..., self.topology.elements[:n], :]
        aft = (0.25 - a.box_offset) * chord  # the middle of the chord lies behind that of the box
        shifted = ends + aft[..., None, None] * torch.tensor([1.0, 0.0, 0.0], dtype=chord.dtype)
        zero = torch.zeros_like(chord)
        parts = [
            Pieces(beams.mass[..., :n], beams.center[..., :n, :], beams.inertia[..., :n, :, :]),
            rods(ribs * length[..., :n], ends, axes[..., :n, :, :], box_width**2 / 12, box_height**2 / 12),
            rods(skins * length[..., :n], shifted, axes[..., :n, :, :], chord**2 / 12, zero),
        ]
        found = {"wing": join(*parts)}
        half = (self.topology.elements.shape[0] - n) // 4
        for boom, name in enumerate(BOOMS):
            first = n + 2 * half * boom
            own, last = slice(first, first + 2 * half), [first + half - 1, first + 2 * half - 1]
            hubs = self.points[..., HUBS[2 * boom : 2 * boom + 2], :]
            reach = self.overhang[..., 2 * boom : 2 * boom + 2]
            outward = hubs + reach[..., None] * axes[..., last, 0, :]
            spread = torch.full_like(reach, 0.5 * a.boom_radius**2)
            tips = rods(
                density * self.sections.area[..., last] * reach,
                torch.stack([hubs, outward], dim=-2),
                axes[..., last, :, :],
                spread,
                spread,
            )
            halves = Pieces(beams.mass[..., own], beams.center[..., own, :], beams.inertia[..., own, :, :])
            found[name] = join(halves, tips)
        return found

    def _node_mass(self, pieces: dict[str, Pieces], inputs: StructuralInputs) -> Tensor:
        """(..., node) kg, structure and rotor groups; half of an element's mass at each of its ends."""
        n, elements = self.spanwise, self.topology.elements
        wing = pieces["wing"].mass.unflatten(-1, (3, n)).sum(-2)
        beams = [wing, *(pieces[name].mass[..., :-2] for name in BOOMS)]
        tips = torch.cat([pieces[name].mass[..., -2:] for name in BOOMS], dim=-1)
        mass = torch.cat(beams, dim=-1)
        total = torch.zeros(*mass.shape[:-1], self.topology.nodes, dtype=mass.dtype)
        total = total.index_add(-1, elements[:, 0], 0.5 * mass).index_add(-1, elements[:, 1], 0.5 * mass)
        rotors = rotor_mass(self.airframe, inputs)[..., None] / 8.0
        return total.index_add(-1, torch.tensor(HUBS), tips + rotors)

    def loads(self, pieces: dict[str, Pieces], inputs: StructuralInputs, loads: WingLoads) -> Tensor:
        """Limit loads (..., case, node, 6). Lift after Schrenk (NACA TM 948) at the quarter chord; drag is left out."""
        a, chain = self.airframe, self.chain
        along, semi_span = self.points[..., chain, 1], self.semi_span[..., None, None]
        root = self.chord[..., :1, :1]

        def chord(y: Tensor) -> Tensor:
            return root * (1.0 - (1.0 - a.taper) * y / semi_span)

        def lift(y: Tensor) -> Tensor:
            ellipse = 2.0 * self.area[..., None, None] / (math.pi * semi_span)
            oval = ellipse * torch.sqrt((1.0 - (y / semi_span) ** 2).clamp(min=0.0))
            return 0.5 * (chord(y) + oval) / self.area[..., None, None]

        lump = hat_lumps(along, lift)[..., None, :]
        arm = hat_lumps(along, lambda y: a.box_offset * chord(y) * lift(y))[..., None, :]
        moment = a.zero_lift_moment * hat_lumps(along, lambda y: chord(y) ** 2)[..., None, :]
        total, pressure = loads.lift[..., None], loads.dynamic_pressure[..., None]
        node_mass = self._node_mass(pieces, inputs)[..., None, :]
        vertical = -GRAVITY * loads.inertia[..., None] * node_mass
        vertical = vertical.index_add(-1, chain, (total * lump).expand(*vertical.shape[:-1], -1))
        hubs = torch.tensor(HUBS)
        vertical = vertical.index_add(-1, hubs, loads.thrust)
        pitching = torch.zeros_like(vertical).index_add(-1, chain, total * arm + pressure * moment)
        spins = torch.tensor(a.spins, dtype=vertical.dtype)
        yawing = torch.zeros_like(vertical).index_add(-1, hubs, -spins * rotor_torque(a, loads.thrust))
        return nodal_loads({2: vertical, 4: pitching, 5: yawing})

    def solve(self, loads: Tensor) -> FrameSolution:
        material = self.airframe.material
        return solve_frame(
            self.points, self.topology, self.sections, loads, material.elastic_modulus, material.shear_modulus
        )


def wing(
    airframe: Airframe,
    inputs: StructuralInputs,
    skin: Tensor,
    web: Tensor,
    cap: Tensor,
    boom: Tensor,
    refinement: int = 1,
) -> Wing:
    """Wing with skin, web (..., 5) m and cap (..., 5) m^2 at fuselage side, inner boom, halfway, outer boom and tip, linear
    between; boom (..., 4) m: walls of inner front, inner rear, outer front and outer rear half."""
    a, b = airframe, span(inputs)
    semi = 0.5 * b
    root_chord = 2.0 * inputs.wing_area / (b * (1.0 + a.taper))
    inner, outer = (fraction * semi for fraction in a.span_fractions)
    y = torch.stack([torch.zeros_like(semi), torch.full_like(semi, a.half_width), inner, outer, semi], dim=-1)
    chord = root_chord[..., None] * (1.0 - (1.0 - a.taper) * y / semi[..., None])
    shift = a.wing_shift * (inputs.fuselage_length - a.baseline_length)
    quarter_x = a.root_quarter_chord[0] + shift[..., None] + math.tan(a.sweep) * y
    z = a.root_quarter_chord[2] + math.tan(a.dihedral) * y
    axis = torch.stack([quarter_x + a.box_offset * chord, y, z], dim=-1)
    offsets = torch.tensor(a.hub_offsets, dtype=y.dtype) * (b / a.baseline_span)[..., None, None]
    base = [2, 2, 3, 3]
    hubs = torch.stack([quarter_x[..., base] + offsets[..., 0], y[..., base], z[..., base] + offsets[..., 1]], dim=-1)
    parts = [refinement * n for n in PARTS]
    points, elements = subdivide(torch.cat([axis, hubs], dim=-2), SEGMENTS, parts)
    held = {0: (1, 3, 5), 1: (0, 2, 4)}  # symmetry at the centre line, fuselage at its side
    up = torch.tensor([0.0, 0.0, 1.0], dtype=y.dtype).expand(len(elements), 3)
    topology = Topology(elements, up, supports(points.shape[-2], held))
    count = sum(parts[:4])
    at_ends = root_chord[..., None, None] * (
        1.0 - (1.0 - a.taper) * points[..., elements[:count], 1] / semi[..., None, None]
    )
    share = torch.cat([_shares(0.0, 0.0, parts[0]), _shares(0.0, 1.0, parts[1])])
    share = torch.cat([share, _shares(1.0, 3.0, parts[2]), _shares(3.0, 4.0, parts[3])])
    width, height = a.box_width * at_ends, a.height_factor * a.thickness_to_chord * at_ends
    ends = BoxWalls(width, height, *((share @ gauge[..., None, :, None]).squeeze(-1) for gauge in (skin, web, cap)))
    middle = BoxWalls(*(getattr(ends, name).mean(-1) for name in BoxWalls.__dataclass_fields__))
    walls = boom.repeat_interleave(2 * refinement, dim=-1)
    radius = torch.full_like(walls, a.boom_radius)
    tube = ShellWall(radius, radius, walls)
    overhang = (a.boom_overhang * b / a.baseline_span)[..., None].expand(*b.shape, 4)
    sections = _concatenated(middle.constants(), tube.constants())
    return Wing(a, points, topology, ends, tube, sections, at_ends, semi, inputs.wing_area, overhang)


def _shares(start: float, end: float, parts: int) -> Tensor:
    """Weights (part, 2 ends, 5) of the span stations for equal parts between two of them, numbered 0 to 4."""
    place = torch.linspace(start, end, parts + 1, dtype=torch.float64)
    ends = torch.stack([place[:-1], place[1:]], dim=-1)
    return (1.0 - (ends[..., None] - torch.arange(5)).abs()).clamp(min=0.0)


def _concatenated(first: BeamSections, second: BeamSections) -> BeamSections:
    names = BeamSections.__dataclass_fields__
    return BeamSections(*(torch.cat([getattr(first, n), getattr(second, n)], dim=-1) for n in names))
