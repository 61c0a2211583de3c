"""From the shape asked for to the motion of the sections that has it: the parameterization of the Lift+Cruise."""

from dataclasses import MISSING, dataclass, fields

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.geometry.bodies import tail_cone_slope
from lpc_mdo.geometry.components import roof_height
from lpc_mdo.geometry.deformation import ChordMeasures, least_deformation
from lpc_mdo.geometry.lifting import SPAN_DEGREE, SPAN_POINTS, trapezoid
from lpc_mdo.numerics.bsplines import basis_matrix, greville_abscissae
from lpc_mdo.numerics.quadrature import gauss_legendre
from lpc_mdo.numerics.tensors import tensor

SECTION_MOTION = 5 * SPAN_POINTS  # numbers that move the sections of one half surface: x, y, z, c, s of each


@dataclass(frozen=True)
class ShapeParameters:
    """What is asked of the shape; leading dimensions batch.

    wing_area, tail_area (...,) m^2; wing_aspect_ratio, tail_aspect_ratio (...,); wing_twist (..., 5) rad, nose up:
    control points, root to tip, of the B-spline along the span that the chord lines follow; tail_position (...,) m: x of
    the root quarter chord; rotor_radius (..., rotor) m; hub_shift (..., rotor, 3) m: how far hubs stand from where they ride on
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


# What a design has to say of the shape, by the names that its variables share with ShapeParameters.
SHAPE_VARIABLES = tuple(field.name for field in fields(ShapeParameters) if field.default is MISSING)


class Parameterization:
    """Callable ShapeParameters -> motion (..., 86); what is constant for a vehicle is made once."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        halves = (vehicle.wing, vehicle.horizontal_tail)
        self.plans = tuple(trapezoid(half) for half in halves)
        means = [0.5 * half.area / plan.half_span for half, plan in zip(halves, self.plans, strict=True)]
        self.mean_chord = torch.tensor(means, dtype=torch.float64)
        rows = torch.from_numpy(greville_abscissae(SPAN_POINTS, SPAN_DEGREE))
        self._stations = basis_matrix(rows, SPAN_POINTS, SPAN_DEGREE)
        nodes, self._mean_weight = gauss_legendre(torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64), 6)
        self._mean_basis = basis_matrix(nodes, SPAN_POINTS, SPAN_DEGREE)
        self._chords = torch.stack([plan.chord for plan in self.plans]) / self.mean_chord[:, None]
        # Weighted with the area that moves, a uniform stretch is the least deformation of a flat planform.
        self._weight = (self._chords * (self._mean_weight @ self._mean_basis)).repeat(1, 2)

    def baseline(self) -> ShapeParameters:
        wing, tail = self.vehicle.wing, self.vehicle.horizontal_tail
        return ShapeParameters(
            wing_area=tensor(wing.area),
            wing_aspect_ratio=tensor(wing.aspect_ratio),
            wing_twist=torch.full((SPAN_POINTS,), wing.incidence, dtype=torch.float64),
            tail_area=tensor(tail.area),
            tail_aspect_ratio=tensor(tail.aspect_ratio),
            tail_position=tensor(tail.root_quarter_chord[0]),
            rotor_radius=tensor([rotor.radius for rotor in self.vehicle.rotors]),
        )

    @property
    def rest(self) -> Tensor:
        """The motion (86,) at which every control point stands as built."""
        still = torch.cat([torch.ones(SPAN_POINTS), torch.zeros(SPAN_POINTS)]).double()
        halves = [torch.cat([plan.quarter_chord.T.flatten(), still]) for plan in self.plans]
        radii = torch.tensor([rotor.radius for rotor in self.vehicle.rotors], dtype=torch.float64)
        return torch.cat([*halves, radii, torch.zeros(3 * len(radii), dtype=torch.float64)])

    def __call__(self, shape: ShapeParameters) -> Tensor:
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
        batch = (turn[..., 0] + mean[..., 0]).shape
        reference = torch.cat([torch.cos(turn), torch.sin(turn)], dim=-1).expand(*batch, -1)
        requested = torch.cat([torch.zeros_like(stations).expand(*batch, -1), mean.expand(*batch, -1)], dim=-1)
        # A uniform stretch is near the least deformation, and exactly it for a flat planform.
        start = (reference * mean).detach()
        state = least_deformation(measures, reference, self._weight, requested, start)
        lines = self._quarter_chords(shape, span.expand(batch))
        shift = (
            torch.zeros(len(self.vehicle.rotors), 3, dtype=torch.float64)
            if shape.hub_shift is None
            else shape.hub_shift
        )
        return torch.cat(
            [
                torch.cat([lines.flatten(-2), state], dim=-1).flatten(-2),
                shape.rotor_radius.expand(*batch[:-1], -1),
                shift.expand(*batch[:-1], -1, -1).flatten(-2),
            ],
            dim=-1,
        )

    def _quarter_chords(self, shape: ShapeParameters, span: Tensor) -> Tensor:
        """Quarter chords (..., 2, 3, section) m of wing and tail for their spans (..., 2) m."""
        rest = torch.stack([plan.quarter_chord.T for plan in self.plans])
        root = rest[:, :, :1]
        half_span = torch.tensor([plan.half_span for plan in self.plans], dtype=torch.float64)
        line = root + (0.5 * span / half_span)[..., None, None] * (rest - root)
        slope = tail_cone_slope(self.vehicle.fuselage, roof_height(self.vehicle))
        along = torch.tensor([[0.0, 0.0, 0.0], [1.0, 0.0, slope]], dtype=torch.float64)
        shift = shape.tail_position - self.vehicle.horizontal_tail.root_quarter_chord[0]
        return line + (shift[..., None, None] * along)[..., None]
