"""The Lift+Cruise outer mold line: named B-spline patches, and their control points as functions of the design.

Only the starboard half of wing and horizontal tail is carried; the port half is its mirror image. Axes: x aft,
y starboard, z up, metres.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from lpc_mdo.config import LiftingSurface, Vehicle, VerticalTail
from lpc_mdo.geometry.sections import section_control_points
from lpc_mdo.geometry.surfaces import Patch
from lpc_mdo.numerics.bsplines import basis_matrix, greville_abscissae

SECTION_POINTS = 13  # fits the camber line of a NACA four-digit section to 2e-4 of the chord
SPAN_POINTS = 5  # one row per twist variable
SPAN_DEGREE = 3
BODY_SHAPE = (9, 9)
BODY_DEGREES = (3, 2)


@dataclass(frozen=True)
class ShapeParameters:
    """What a design may change of the shape; leading dimensions batch.

    wing_area, tail_area (...,) m^2; wing_aspect_ratio, tail_aspect_ratio (...,); wing_twist (..., 5) rad, nose up,
    one value per spanwise row of control points, root to tip; tail_position (...,) m: x of the root quarter chord.
    """

    wing_area: Tensor
    wing_aspect_ratio: Tensor
    wing_twist: Tensor
    tail_area: Tensor
    tail_aspect_ratio: Tensor
    tail_position: Tensor


@dataclass(frozen=True)
class OuterMoldLine:
    """Patches by name. Control points come from `control_points`; all else is a mapped array of them."""

    vehicle: Vehicle

    @cached_property
    def patches(self) -> dict[str, Patch]:
        lifting = (SECTION_POINTS, SPAN_POINTS)
        plan = [
            *(
                (f"{surface}_{side}", lifting, (3, SPAN_DEGREE))
                for surface in ("wing", "horizontal_tail", "vertical_tail")
                for side in ("upper", "lower")
            ),
            ("fuselage", BODY_SHAPE, BODY_DEGREES),
            *((f"boom_{rotor.name}", (1, 1), (0, 0)) for rotor in self.vehicle.lift_rotors),
            *((f"hub_{rotor.name}", (1, 1), (0, 0)) for rotor in self.vehicle.rotors),
        ]
        patches, first = {}, 0
        for name, shape, degrees in plan:
            patches[name] = Patch(name, first, shape, degrees)
            first += shape[0] * shape[1]
        return patches

    @cached_property
    def size(self) -> int:
        """Number of control points."""
        return sum(patch.size for patch in self.patches.values())

    @cached_property
    def _constant(self) -> dict[str, Tensor]:
        """Control points that no design variable moves, and unit-chord sections."""
        sections = {
            name: tuple(torch.as_tensor(side) for side in section_control_points(digits, SECTION_POINTS))
            for name, digits in self._airfoils.items()
        }
        return {
            **{f"{name}_{side}": s[i] for name, s in sections.items() for i, side in enumerate(("upper", "lower"))},
            "fuselage": _fuselage_points(self.vehicle),
            "rows": torch.as_tensor(greville_abscissae(SPAN_POINTS, SPAN_DEGREE)),
            "hubs": torch.tensor([rotor.hub for rotor in self.vehicle.rotors], dtype=torch.float64),
        }

    @property
    def _airfoils(self) -> dict[str, str]:
        tail_thickness = round(100 * self.vehicle.vertical_tail.thickness_to_chord)
        return {
            "wing": self.vehicle.wing.airfoil,
            "horizontal_tail": self.vehicle.horizontal_tail.airfoil,
            "vertical_tail": f"00{tail_thickness:02d}",
        }

    def baseline_parameters(self) -> ShapeParameters:
        wing, tail = self.vehicle.wing, self.vehicle.horizontal_tail
        number = lambda value: torch.tensor(value, dtype=torch.float64)  # noqa: E731
        return ShapeParameters(
            wing_area=number(wing.area),
            wing_aspect_ratio=number(wing.aspect_ratio),
            wing_twist=torch.full((SPAN_POINTS,), wing.incidence, dtype=torch.float64),
            tail_area=number(tail.area),
            tail_aspect_ratio=number(tail.aspect_ratio),
            tail_position=number(tail.root_quarter_chord[0]),
        )

    def control_points(self, shape: ShapeParameters) -> Tensor:
        """All control points (..., control point, 3) in m for the given shape.

        Sections scale with the chord and turn about their quarter chord; booms and hubs keep their fraction of the
        semi-span and their offset from the wing's quarter-chord line.
        """
        vehicle, constant = self.vehicle, self._constant
        wing_root = torch.tensor(vehicle.wing.root_quarter_chord, dtype=torch.float64)
        tail_root = torch.stack(
            torch.broadcast_tensors(
                shape.tail_position,
                *(torch.tensor(c, dtype=torch.float64) for c in vehicle.horizontal_tail.root_quarter_chord[1:]),
            ),
            dim=-1,
        )
        tail_twist = torch.full((SPAN_POINTS,), vehicle.horizontal_tail.incidence, dtype=torch.float64)
        rows = constant["rows"]
        groups = []
        for side in ("upper", "lower"):
            groups.append(
                _half_surface(
                    constant[f"wing_{side}"],
                    rows,
                    vehicle.wing,
                    shape.wing_area,
                    shape.wing_aspect_ratio,
                    shape.wing_twist,
                    wing_root,
                )
            )
        for side in ("upper", "lower"):
            groups.append(
                _half_surface(
                    constant[f"horizontal_tail_{side}"],
                    rows,
                    vehicle.horizontal_tail,
                    shape.tail_area,
                    shape.tail_aspect_ratio,
                    tail_twist,
                    tail_root,
                )
            )
        fin = vehicle.vertical_tail
        groups += [_fin(constant[f"vertical_tail_{side}"], rows, fin) for side in ("upper", "lower")]
        groups.append(constant["fuselage"])
        booms, hubs = self._attached(shape, wing_root)
        groups += [booms, hubs]
        batch = torch.broadcast_shapes(*(group.shape[:-2] for group in groups))
        return torch.cat([group.expand(*batch, *group.shape[-2:]) for group in groups], dim=-2)

    def _attached(self, shape: ShapeParameters, wing_root: Tensor) -> tuple[Tensor, Tensor]:
        """Boom attachments on the quarter-chord line (..., 8, 3) and hubs (..., 9, 3)."""
        wing = self.vehicle.wing
        hubs = self._constant["hubs"]
        half_span = 0.5 * torch.sqrt(shape.wing_area * shape.wing_aspect_ratio)
        baseline_half_span = 0.5 * math.sqrt(wing.area * wing.aspect_ratio)
        lift = hubs[:-1]
        scaled = lift[:, 1] * (half_span / baseline_half_span)[..., None]
        slopes = (math.tan(wing.quarter_chord_sweep), math.tan(wing.dihedral))

        def on_quarter_chord(y: Tensor) -> Tensor:
            outboard = y.abs()
            return torch.stack([wing_root[0] + slopes[0] * outboard, y, wing_root[2] + slopes[1] * outboard], dim=-1)

        booms = on_quarter_chord(scaled)
        moved = lift + booms - on_quarter_chord(lift[:, 1])
        pusher = hubs[-1:].expand(*moved.shape[:-2], 1, 3)
        return booms, torch.cat([moved, pusher], dim=-2)


def _half_surface(
    section: Tensor,
    rows: Tensor,
    surface: LiftingSurface,
    area: Tensor,
    aspect_ratio: Tensor,
    twist: Tensor,
    root: Tensor,
) -> Tensor:
    """Control points (..., section x rows, 3) of one side of a starboard half surface."""
    half_span = 0.5 * torch.sqrt(area * aspect_ratio)
    root_chord = area / (half_span * (1.0 + surface.taper))
    chord = root_chord[..., None] * (1.0 - (1.0 - surface.taper) * rows)  # (..., row)
    y = half_span[..., None] * rows
    axis_x = root[..., 0:1] + math.tan(surface.quarter_chord_sweep) * y
    axis_z = root[..., 2:3] + math.tan(surface.dihedral) * y
    cos, sin = torch.cos(twist), torch.sin(twist)
    along, up = section[:, 0:1] - 0.25, section[:, 1:2]
    x = axis_x[..., None, :] + (along * cos[..., None, :] + up * sin[..., None, :]) * chord[..., None, :]
    z = axis_z[..., None, :] + (up * cos[..., None, :] - along * sin[..., None, :]) * chord[..., None, :]
    x, y, z = torch.broadcast_tensors(x, y[..., None, :] + root[..., 1:2, None], z)
    return torch.stack([x, y, z], dim=-1).flatten(-3, -2)


def _fin(section: Tensor, rows: Tensor, fin: VerticalTail) -> Tensor:
    """Control points of one side of the fin; unswept quarter chord, span upward."""
    height = math.sqrt(fin.area * fin.aspect_ratio)
    chord = 2.0 * fin.area / (height * (1.0 + fin.taper)) * (1.0 - (1.0 - fin.taper) * rows)
    root = torch.tensor(fin.root_quarter_chord, dtype=torch.float64)
    x = root[0] + (section[:, 0:1] - 0.25) * chord
    y = root[1] + section[:, 1:2] * chord
    z = (root[2] + height * rows).expand_as(x)
    return torch.stack([x, y, z], dim=-1).flatten(0, 1)


def _fuselage_points(vehicle: Vehicle) -> Tensor:
    """Control net of the fuselage: elliptical rings on a straight axis from nose to rear, full over the cabin.

    The ring sizes (fractions of the half width and half height) are ASSUMED: rounded nose, constant cabin, tail cone.
    Each ring interpolates an ellipse, to 0.6 % of its radius, and closes at the top, so that the body is symmetric and
    its cabin has the published width and height.
    """
    body = vehicle.fuselage
    fractions = torch.tensor([0.0, 0.45, 0.85, 1.0, 1.0, 1.0, 0.75, 0.35, 0.05], dtype=torch.float64)
    stations = torch.tensor([0.0, 0.0, 0.08, 0.2, 0.35, 0.5, 0.7, 0.88, 1.0], dtype=torch.float64)
    nose, rear = (torch.tensor(point, dtype=torch.float64) for point in (body.nose, body.rear))
    around = torch.as_tensor(greville_abscissae(BODY_SHAPE[1], BODY_DEGREES[1]))
    circle = torch.stack([torch.sin(2.0 * math.pi * around), torch.cos(2.0 * math.pi * around)], dim=-1)
    ring_y, ring_z = torch.linalg.solve(basis_matrix(around, BODY_SHAPE[1], BODY_DEGREES[1]), circle).unbind(-1)
    axis = nose + stations[:, None] * (rear - nose)
    points = torch.stack(
        [
            axis[:, 0:1].expand(-1, BODY_SHAPE[1]),
            axis[:, 1:2] + fractions[:, None] * 0.5 * body.width * ring_y,
            axis[:, 2:3] + fractions[:, None] * 0.5 * body.height * ring_z,
        ],
        dim=-1,
    )
    return points.flatten(0, 1)
