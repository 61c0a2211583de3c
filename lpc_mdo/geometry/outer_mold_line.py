"""The Lift+Cruise outer mold line: named B-spline patches, and their control points as functions of the design.

Only the starboard half of wing and horizontal tail is carried; the port half is its mirror image. Axes: x aft,
y starboard, z up, metres.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from lpc_mdo.config import RotorSpecification, Vehicle
from lpc_mdo.geometry.components import (
    MIRRORED,
    attachment_basis,
    attachment_point,
    component_of,
    mirror,
    patches,
    roof_height,
    span_fraction,
)
from lpc_mdo.geometry.deformation import FreeFormBlock
from lpc_mdo.geometry.lifting import SPAN_POINTS
from lpc_mdo.geometry.mapped import MappedArray, stack
from lpc_mdo.geometry.parameterization import SECTION_MOTION, Parameterization, ShapeParameters
from lpc_mdo.geometry.surfaces import BSplineSurface


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
        self.motion = Parameterization(vehicle)
        self.plans = self.motion.plans
        self.patches = patches(vehicle)
        self.size = sum(patch.size for patch in self.patches.values())
        self.roof_height = roof_height(vehicle)

    def baseline_parameters(self) -> ShapeParameters:
        """The shape as the vehicle file has it."""
        return self.motion.baseline()

    def control_points(self, shape: ShapeParameters) -> Tensor:
        """All control points (..., control point, 3) in m for the given shape. Raises DeformationError."""
        return self._map(self.motion(shape)).unflatten(-1, (self.size, 3))

    def with_hubs_at(self, shape: ShapeParameters, hubs: Tensor) -> ShapeParameters:
        """The shape with its hubs at the positions asked for, (..., rotor, 3) m."""
        riding = self.moved(self.hubs)(self.motion(replace(shape, hub_shift=None))).unflatten(-1, (-1, 3))
        return replace(shape, hub_shift=hubs - riding)

    @cached_property
    def hubs(self) -> MappedArray:
        """Hub points of all rotors, at the foot of their hubs."""
        foot = torch.zeros(1, dtype=torch.float64)
        return stack([self.patches[f"hub_{rotor.name}"].points(foot, foot, self.size) for rotor in self.vehicle.rotors])

    @cached_property
    def attachments(self) -> dict[str, MappedArray]:
        """The point (1,) of the wing's quarter chord that carries each lift rotor's boom; of its mirror image to port."""
        ends = torch.tensor([0.0, 1.0], dtype=torch.float64)
        found = {}
        for rotor in self.vehicle.lift_rotors:
            v = span_fraction(rotor, self.plans[0])
            edges = [self.patches["wing_upper"].points(end[None], v, self.size) for end in ends]
            found[rotor.name] = 0.75 * edges[0] + 0.25 * edges[1]
        return found

    def surfaces(self, control_points: Tensor) -> dict[str, BSplineSurface]:
        """Every surface of both sides by name, du x dv outward; the port halves end in `_port`."""
        found = {}
        for name, patch in self.patches.items():
            surface = patch.moved(control_points)
            found[name] = surface if patch.is_outward else surface.reversed()
            if component_of(name) in MIRRORED:
                found[f"{name}_port"] = found[name].mirrored()
        return found

    @property
    def components(self) -> dict[str, list[str]]:
        """Names of the surfaces of each component, as `surfaces` has them."""
        found: dict[str, list[str]] = {}
        for name in self.patches:
            component = component_of(name)
            own = [name, f"{name}_port"] if component in MIRRORED else [name]
            found.setdefault(component, []).extend(own)
        return found

    def moved(self, array: MappedArray) -> LinearMap:
        """A mapped array as a linear map of the motion: one small matrix, made once."""
        full = self._map
        matrix = array.matrix @ full.matrix.unflatten(0, (self.size, 3)).flatten(1)
        offset = array.matrix @ full.offset.reshape(self.size, 3)
        return LinearMap(matrix.unflatten(1, (3, -1)).flatten(0, 1), offset.flatten())

    @cached_property
    def _map(self) -> LinearMap:
        """The constant linear map from motions to flat control points."""
        rest = torch.cat([patch.surface.control_points.flatten(0, 1) for patch in self.patches.values()])
        count = len(self.vehicle.rotors)
        matrix = torch.zeros(self.size, 3, 2 * SECTION_MOTION + 4 * count, dtype=torch.float64)
        for i, (component, plan) in enumerate(zip(MIRRORED, self.plans, strict=True)):
            rows = self._rows(component)
            block = FreeFormBlock.with_sections(rest[rows], plan.quarter_chord[:, 1])
            matrix[rows, :, SECTION_MOTION * i : SECTION_MOTION * (i + 1)] = block.section_map(
                rest[rows], plan.quarter_chord
            )
        for i, rotor in enumerate(self.vehicle.rotors):
            disk = self._rows(f"disk_{rotor.name}")
            center = rest[disk][0]
            matrix[disk, :, 2 * SECTION_MOTION + i] = (rest[disk] - center) / rotor.radius
            shift = [2 * SECTION_MOTION + count + 3 * i + axis for axis in range(3)]
            for part in ("hub", "disk"):
                matrix[self._rows(f"{part}_{rotor.name}"), range(3), shift] = 1.0
            if rotor.kind == "lift":
                boom = self._rows(f"boom_{rotor.name}")
                attachment, hub = attachment_point(rotor, self.plans[0]), torch.tensor(rotor.hub, dtype=torch.float64)
                reach = (rest[boom] - attachment) @ (hub - attachment) / ((hub - attachment) ** 2).sum()
                for axis in range(3):
                    matrix[boom, axis, shift[axis]] = reach  # none at the wing, all at the hub
                self._ride_on_wing(matrix, rotor)
        flat = matrix.flatten(0, 1)
        return LinearMap(flat, rest.flatten() - flat @ self.motion.rest)

    def _ride_on_wing(self, matrix: Tensor, rotor: RotorSpecification) -> None:
        """Let boom, hub and disk follow the point of the wing that carries them; writes into `matrix`."""
        for part in ("boom", "hub", "disk"):
            rows = self._rows(f"{part}_{rotor.name}")
            for axis in range(3):
                columns = slice(SPAN_POINTS * axis, SPAN_POINTS * (axis + 1))
                matrix[rows, axis, columns] += mirror(rotor)[axis] * attachment_basis(rotor, self.plans[0])

    def _rows(self, component: str) -> slice:
        """Where the control points of a component stand in the list."""
        own = [patch for name, patch in self.patches.items() if component_of(name) == component]
        return slice(own[0].first, own[-1].first + own[-1].size)
