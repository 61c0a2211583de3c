"""The Lift+Cruise outer mold line: named B-spline patches, and their control points as functions of the design.

Only the starboard half of wing and horizontal tail is carried; the port half is its mirror image. Axes: x aft,
y starboard, z up, metres.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from lpc_mdo.config import LiftingSurface, RotorSpecification, Vehicle
from lpc_mdo.geometry.bodies import disk_surface, fuselage_surface, tail_cone_slope, tube_surface
from lpc_mdo.geometry.deformation import ChordMeasures, FreeFormBlock, least_deformation
from lpc_mdo.geometry.lifting import SPAN_DEGREE, SPAN_POINTS, fin_surface, half_surface, trapezoid
from lpc_mdo.geometry.mapped import MappedArray, stack
from lpc_mdo.geometry.surfaces import BSplineSurface, Patch
from lpc_mdo.numerics.bsplines import basis_matrix, greville_abscissae
from lpc_mdo.numerics.quadrature import gauss_legendre

DISK_OFFSET = 0.62 * 0.3048  # m from hub point to rotor disk; geometry set-up script of the study's authors
HUB_RADIUS = 0.12  # m, ASSUMED: 8 % of the lift rotors' radius
MIRRORED = ("wing", "horizontal_tail")  # carried as starboard halves
INWARD = ("wing_lower", "horizontal_tail_lower", "vertical_tail_starboard")  # patches whose du x dv enters the body
MOTION = 5 * SPAN_POINTS  # numbers that move the sections of one half surface


@dataclass(frozen=True)
class ShapeParameters:
    """What is asked of the shape; leading dimensions batch.

    wing_area, tail_area (...,) m^2; wing_aspect_ratio, tail_aspect_ratio (...,); wing_twist (..., 5) rad, nose up:
    control points, root to tip, of the B-spline along the span that the chord lines follow; tail_position (...,) m: x of
    the root quarter chord; rotor_radius (..., 9) m; hub_shift (..., 9, 3) m: how far hubs stand from where they ride on
    the wing (the pusher: from where it was built), not at all if left out.
    """

    wing_area: Tensor
    wing_aspect_ratio: Tensor
    wing_twist: Tensor
    tail_area: Tensor
    tail_aspect_ratio: Tensor
    tail_position: Tensor
    rotor_radius: Tensor
    hub_shift: Tensor | None = None


@dataclass(frozen=True)
class LinearMap:
    """Flat coordinates (..., coordinate) in m from motions (..., motion): matrix (coordinate, motion), offset."""

    matrix: Tensor
    offset: Tensor

    def __call__(self, motion: Tensor) -> Tensor:
        return motion @ self.matrix.T + self.offset


class OuterMoldLine:
    """Patches by name. `control_points` deforms them; all else is a mapped array of the control points."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.plans = (trapezoid(vehicle.wing), trapezoid(vehicle.horizontal_tail))
        self.mean_chord = torch.tensor(
            [0.5 * s.area / plan.half_span for s, plan in zip(self._halves, self.plans, strict=True)],
            dtype=torch.float64,
        )
        self.patches = _patches(self._surfaces())
        self.size = sum(patch.size for patch in self.patches.values())
        self._stations = basis_matrix(
            torch.from_numpy(greville_abscissae(SPAN_POINTS, SPAN_DEGREE)), SPAN_POINTS, SPAN_DEGREE
        )
        nodes, self._mean_weight = gauss_legendre(torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64), 6)
        self._mean_basis = basis_matrix(nodes, SPAN_POINTS, SPAN_DEGREE)
        self._chords = torch.stack([plan.chord for plan in self.plans]) / self.mean_chord[:, None]
        # Weighted with the area that moves, a uniform stretch is the least deformation of a flat planform.
        self._weight = (self._chords * (self._mean_weight @ self._mean_basis)).repeat(1, 2)

    @property
    def _halves(self) -> tuple[LiftingSurface, LiftingSurface]:
        return self.vehicle.wing, self.vehicle.horizontal_tail

    @cached_property
    def roof_height(self) -> float:
        """z of the cabin's roof, m: the lower side of the wing's centre section rests on it."""
        wing = self.vehicle.wing
        return wing.root_quarter_chord[2] - 0.5 * wing.thickness_to_chord * float(self.plans[0].chord[0])

    def _surfaces(self) -> dict[str, dict[str, BSplineSurface]]:
        """Surfaces by component and part, as the vehicle file has them."""
        vehicle = self.vehicle
        parts = {
            "wing": half_surface(vehicle.wing),
            "horizontal_tail": half_surface(vehicle.horizontal_tail),
            "vertical_tail": fin_surface(vehicle.vertical_tail),
            "fuselage": {"": fuselage_surface(vehicle.fuselage, self.roof_height)},
        }
        for rotor in vehicle.rotors:
            hub = torch.tensor(rotor.hub, dtype=torch.float64)
            if rotor.kind == "lift":
                attachment = self._attachment_point(rotor)
                outward = torch.nn.functional.normalize(hub - attachment, dim=0)
                end = hub + vehicle.booms.overhang * outward
                parts[f"boom_{rotor.name}"] = {"": tube_surface(end, attachment, 0.5 * vehicle.booms.diameter)}
            axis, starboard = _axis(rotor), torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
            center = hub + DISK_OFFSET * axis if rotor.kind == "lift" else hub
            parts[f"hub_{rotor.name}"] = {"": tube_surface(hub, hub + DISK_OFFSET * axis, HUB_RADIUS)}
            up = torch.linalg.cross(starboard, axis)
            parts[f"disk_{rotor.name}"] = {"": disk_surface(center, rotor.radius, starboard, up)}
        return parts

    def _span_fraction(self, rotor: RotorSpecification) -> Tensor:
        return torch.tensor([abs(rotor.hub[1]) / self.plans[0].half_span], dtype=torch.float64)

    def _attachment_basis(self, rotor: RotorSpecification) -> Tensor:
        """Weights (section,) of the wing's quarter chords in the point that carries the boom."""
        return basis_matrix(self._span_fraction(rotor), SPAN_POINTS, SPAN_DEGREE)[0]

    def _attachment_point(self, rotor: RotorSpecification) -> Tensor:
        side = torch.tensor([1.0, 1.0 if rotor.hub[1] > 0.0 else -1.0, 1.0], dtype=torch.float64)
        return self._attachment_basis(rotor) @ self.plans[0].quarter_chord * side

    @cached_property
    def attachments(self) -> dict[str, MappedArray]:
        """The point (1,) of the wing's quarter chord that carries each lift rotor's boom; of its mirror image to port."""
        ends = torch.tensor([0.0, 1.0], dtype=torch.float64)
        found = {}
        for rotor in self.vehicle.lift_rotors:
            v = self._span_fraction(rotor)
            edges = [self.patches["wing_upper"].points(end[None], v, self.size) for end in ends]
            found[rotor.name] = 0.75 * edges[0] + 0.25 * edges[1]
        return found

    def baseline_parameters(self) -> ShapeParameters:
        wing, tail = self._halves
        number = lambda value: torch.tensor(value, dtype=torch.float64)  # noqa: E731
        return ShapeParameters(
            wing_area=number(wing.area),
            wing_aspect_ratio=number(wing.aspect_ratio),
            wing_twist=torch.full((SPAN_POINTS,), wing.incidence, dtype=torch.float64),
            tail_area=number(tail.area),
            tail_aspect_ratio=number(tail.aspect_ratio),
            tail_position=number(tail.root_quarter_chord[0]),
            rotor_radius=number([rotor.radius for rotor in self.vehicle.rotors]),
        )

    def motion(self, shape: ShapeParameters) -> Tensor:
        """What moves the control points (..., 86): x, y, z, c, s of the sections of wing and tail, radii, hub shifts.

        The span stretches each half and its sweep and dihedral are kept; chord and turn of the sections are the least
        deformation that has the mean chord and twist asked for. The wing's root stays on the fuselage, the tail's root
        slides along the axis of the tail cone, booms and hubs ride on the wing; a hub that is shifted takes the outer end of
        its boom along. Raises DeformationError.
        """
        area = torch.stack(torch.broadcast_tensors(shape.wing_area, shape.tail_area), dim=-1)
        aspect_ratio = torch.stack(torch.broadcast_tensors(shape.wing_aspect_ratio, shape.tail_aspect_ratio), dim=-1)
        span = torch.sqrt(area * aspect_ratio)
        twist = shape.wing_twist - self.vehicle.wing.incidence
        turn = torch.stack([twist, torch.zeros_like(twist)], dim=-2)  # (..., 2, section)
        stations = turn @ self._stations.T
        measures = ChordMeasures(stations, self._stations, self._chords, self._mean_basis, self._mean_weight)
        mean = (area / span / self.mean_chord)[..., None]
        batch = (turn[..., 0] + mean[..., 0]).shape  # torch.broadcast_shapes would load a symbolic algebra package
        reference = torch.cat([torch.cos(turn), torch.sin(turn)], dim=-1).expand(*batch, -1)
        requested = torch.cat([torch.zeros_like(stations).expand(*batch, -1), mean.expand(*batch, -1)], dim=-1)
        state = least_deformation(measures, reference, self._weight, requested)
        lines = self._quarter_chords(shape, span.expand(batch))
        shift = torch.zeros_like(self._hubs) if shape.hub_shift is None else shape.hub_shift
        return torch.cat(
            [
                torch.cat([lines.flatten(-2), state], dim=-1).flatten(-2),
                shape.rotor_radius.expand(*batch[:-1], -1),
                shift.expand(*batch[:-1], -1, -1).flatten(-2),
            ],
            dim=-1,
        )

    def with_hubs_at(self, shape: ShapeParameters, hubs: Tensor) -> ShapeParameters:
        """The shape with its hubs at the positions asked for, (..., 9, 3) m."""
        riding = self.moved(self.hubs)(self.motion(replace(shape, hub_shift=None))).unflatten(-1, (-1, 3))
        return replace(shape, hub_shift=hubs - riding)

    def _quarter_chords(self, shape: ShapeParameters, span: Tensor) -> Tensor:
        """Quarter chords (..., 2, 3, section) m of wing and tail for their spans (..., 2) m."""
        rest = torch.stack([plan.quarter_chord.T for plan in self.plans])
        root = rest[:, :, :1]
        half_span = torch.tensor([plan.half_span for plan in self.plans], dtype=torch.float64)
        line = root + (0.5 * span / half_span)[..., None, None] * (rest - root)
        slope = tail_cone_slope(self.vehicle.fuselage, self.roof_height)
        along = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, slope]], dtype=torch.float64)
        shift = shape.tail_position - self.vehicle.horizontal_tail.root_quarter_chord[0]
        return line + (shift[..., None, None] * along)[..., None]

    @cached_property
    def _map(self) -> LinearMap:
        """The constant linear map from motions to flat control points."""
        rest = torch.cat([patch.surface.control_points.flatten(0, 1) for patch in self.patches.values()])
        count = len(self.vehicle.rotors)
        matrix = torch.zeros(self.size, 3, 2 * MOTION + 4 * count, dtype=torch.float64)
        for i, (component, plan) in enumerate(zip(MIRRORED, self.plans, strict=True)):
            rows = self._rows(component)
            block = FreeFormBlock.with_sections(rest[rows], plan.quarter_chord[:, 1])
            matrix[rows, :, MOTION * i : MOTION * (i + 1)] = block.section_map(rest[rows], plan.quarter_chord)
        for i, rotor in enumerate(self.vehicle.rotors):
            disk = self._rows(f"disk_{rotor.name}")
            center = rest[disk][0]
            matrix[disk, :, 2 * MOTION + i] = (rest[disk] - center) / rotor.radius
            shift = [2 * MOTION + count + 3 * i + axis for axis in range(3)]
            for part in ("hub", "disk"):
                matrix[self._rows(f"{part}_{rotor.name}"), range(3), shift] = 1.0
            if rotor.kind == "lift":
                boom = self._rows(f"boom_{rotor.name}")
                attachment, hub = self._attachment_point(rotor), self._hubs[i]
                reach = (rest[boom] - attachment) @ (hub - attachment) / ((hub - attachment) ** 2).sum()
                for axis in range(3):
                    matrix[boom, axis, shift[axis]] = reach  # none at the wing, all at the hub
                self._ride_on_wing(matrix, rotor)
        flat = matrix.flatten(0, 1)
        return LinearMap(flat, rest.flatten() - flat @ self._rest_motion)

    def _ride_on_wing(self, matrix: Tensor, rotor: RotorSpecification) -> None:
        """Let boom, hub and disk follow the point of the wing that carries them; writes into `matrix`."""
        side = torch.tensor([1.0, 1.0 if rotor.hub[1] > 0.0 else -1.0, 1.0], dtype=torch.float64)
        for part in ("boom", "hub", "disk"):
            rows = self._rows(f"{part}_{rotor.name}")
            for axis in range(3):
                columns = slice(SPAN_POINTS * axis, SPAN_POINTS * (axis + 1))
                matrix[rows, axis, columns] += side[axis] * self._attachment_basis(rotor)

    @property
    def _hubs(self) -> Tensor:
        """Hub points (9, 3) m as built."""
        return torch.tensor([rotor.hub for rotor in self.vehicle.rotors], dtype=torch.float64)

    @property
    def _rest_motion(self) -> Tensor:
        """The motion at which every control point stands as built."""
        halves = [torch.cat([plan.quarter_chord.T.flatten(), _still()]) for plan in self.plans]
        radii = torch.tensor([rotor.radius for rotor in self.vehicle.rotors], dtype=torch.float64)
        return torch.cat([*halves, radii, torch.zeros(3 * len(radii), dtype=torch.float64)])

    def _rows(self, component: str) -> slice:
        """Where the control points of a component stand in the list."""
        own = [patch for name, patch in self.patches.items() if _component(name) == component]
        return slice(own[0].first, own[-1].first + own[-1].size)

    def moved(self, array: MappedArray) -> LinearMap:
        """A mapped array as a linear map of the motion: one small matrix, made once."""
        full = self._map
        matrix = array.matrix @ full.matrix.unflatten(0, (self.size, 3)).flatten(1)
        offset = array.matrix @ full.offset.reshape(self.size, 3)
        return LinearMap(matrix.unflatten(1, (3, -1)).flatten(0, 1), offset.flatten())

    def control_points(self, shape: ShapeParameters) -> Tensor:
        """All control points (..., control point, 3) in m for the given shape. Raises DeformationError."""
        return self._map(self.motion(shape)).unflatten(-1, (self.size, 3))

    @cached_property
    def hubs(self) -> MappedArray:
        """Hub points of all rotors, at the foot of their hubs."""
        foot = torch.zeros(1, dtype=torch.float64)
        return stack([self.patches[f"hub_{rotor.name}"].points(foot, foot, self.size) for rotor in self.vehicle.rotors])

    def surfaces(self, control_points: Tensor) -> dict[str, BSplineSurface]:
        """Every surface of both sides by name, du x dv outward; the port halves end in `_port`."""
        found = {}
        for name, patch in self.patches.items():
            surface = patch.moved(control_points)
            found[name] = surface if patch.is_outward else surface.reversed()
            if _component(name) in MIRRORED:
                found[f"{name}_port"] = found[name].mirrored()
        return found

    @property
    def components(self) -> dict[str, list[str]]:
        """Names of the surfaces of each component, as `surfaces` has them."""
        found: dict[str, list[str]] = {}
        for name in self.patches:
            component = _component(name)
            own = [name, f"{name}_port"] if component in MIRRORED else [name]
            found.setdefault(component, []).extend(own)
        return found


def _still() -> Tensor:
    return torch.cat([torch.ones(SPAN_POINTS, dtype=torch.float64), torch.zeros(SPAN_POINTS, dtype=torch.float64)])


def _axis(rotor: RotorSpecification) -> Tensor:
    """Unit vector along the thrust."""
    return torch.tensor([0.0, 0.0, 1.0] if rotor.kind == "lift" else [-1.0, 0.0, 0.0], dtype=torch.float64)


def _patches(parts: dict[str, dict[str, BSplineSurface]]) -> dict[str, Patch]:
    patches, first = {}, 0
    for component, surfaces in parts.items():
        for part, surface in surfaces.items():
            name = f"{component}_{part}" if part else component
            patches[name] = Patch(name, first, surface, name not in INWARD)
            first += patches[name].size
    return patches


def _component(patch: str) -> str:
    """Name of the component that a patch belongs to."""
    surfaces = ("wing", "horizontal_tail", "vertical_tail")
    return next((name for name in surfaces if patch.startswith(f"{name}_")), patch)
