"""What the disciplines need of the geometry: meshes, hub points, areas, spans and arms, all off the control points."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.config.layout import booms
from lpc_mdo.geometry.mapped import stack
from lpc_mdo.geometry.meshing import camber_mesh, edges, wetted_area
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.numerics.quadrature import gauss_legendre
from lpc_mdo.numerics.spacing import tip_inset_spacing, uniform_spacing

WING_PANELS = (4, 8)  # chordwise, spanwise per half; docs/models.md gives the mesh error
TAIL_PANELS = (2, 5)
_NODES, _NODE_WEIGHTS = gauss_legendre(torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64), 6)
_STATIONS = torch.cat([torch.zeros(1).double(), _NODES, torch.ones(1).double()])  # root, quadrature, tip
_WEIGHTS = torch.nn.functional.pad(_NODE_WEIGHTS, (1, 1))


@dataclass(frozen=True)
class SurfaceMeasures:
    """Planform measures (...,) of a whole lifting surface: m^2, m; chord is the mean aerodynamic chord."""

    area: Tensor
    span: Tensor
    mean_chord: Tensor
    aerodynamic_center: Tensor  # (..., 3) quarter chord at the centroid of area, m

    @property
    def aspect_ratio(self) -> Tensor:
        return self.span**2 / self.area


@dataclass(frozen=True)
class Shape:
    """The deformed aircraft; leading dimensions batch, lengths in m."""

    wing_mesh: Tensor  # (..., chordwise + 1, spanwise + 1, 3) starboard camber surface
    tail_mesh: Tensor  # the same, undeflected
    tail_hinge: Tensor  # (..., 3) a point on the axis, parallel to y, about which the tail turns
    wing: SurfaceMeasures
    tail: SurfaceMeasures
    hubs: Tensor  # (..., rotor, 3)
    boom_length: Tensor  # (..., boom of one side)
    fuselage_wetted_area: Tensor  # ()


class Geometry:
    """Outer mold line with its mapped arrays, built once for a vehicle.

    All that the disciplines need is one linear map of the motion of the sections: a design costs the parameterization
    solve and one small matrix product.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        mold = self.outer_mold_line = OuterMoldLine(vehicle)
        self.arrays = {
            "wing_mesh": camber_mesh(mold, "wing", uniform_spacing(WING_PANELS[0]), tip_inset_spacing(WING_PANELS[1])),
            "tail_mesh": camber_mesh(
                mold, "horizontal_tail", uniform_spacing(TAIL_PANELS[0]), tip_inset_spacing(TAIL_PANELS[1])
            ),
            "wing_edges": edges(mold, "wing", _STATIONS),
            "tail_edges": edges(mold, "horizontal_tail", _STATIONS),
            "hubs": mold.hubs,
        }
        self.booms = booms(vehicle)
        # A boom with one rotor ends where it is fixed to the wing.
        ends = [rotors[0] for rotors in (boom.rotors for boom in self.booms) if len(rotors) == 1]
        self._ends = [port for port, _ in ends]
        if self._ends:
            fixed = [mold.attachments[vehicle.rotors[port].name] for port in self._ends]
            self.arrays["boom_ends"] = stack(fixed)
        self._map = mold.moved(stack(list(self.arrays.values())))
        self._sizes = [3 * array.matrix.shape[0] for array in self.arrays.values()]
        body = mold.patches["fuselage"].surface  # nothing moves it
        self.fuselage_wetted_area = wetted_area(body)

    def __call__(self, parameters: ShapeParameters) -> Shape:
        """The aircraft's shape for the given parameters; every output is a smooth function of them.

        Raises DeformationError where no shape has the measures asked for.
        """
        flat = self._map(self.outer_mold_line.motion(parameters)).split(self._sizes, dim=-1)
        points = {
            name: part.unflatten(-1, (*array.shape, 3))
            for (name, array), part in zip(self.arrays.items(), flat, strict=True)
        }
        hubs, root = points["hubs"], points["tail_edges"][..., 0, :]
        return Shape(
            wing_mesh=points["wing_mesh"],
            tail_mesh=points["tail_mesh"],
            tail_hinge=0.75 * root[..., 0, :] + 0.25 * root[..., 1, :],
            wing=_measures(points["wing_edges"]),
            tail=_measures(points["tail_edges"]),
            hubs=hubs,
            boom_length=self._boom_lengths(hubs, points),
            fuselage_wetted_area=self.fuselage_wetted_area,
        )

    def _boom_lengths(self, hubs: Tensor, points: dict[str, Tensor]) -> Tensor:
        """(..., boom of one side) from hub to hub, or from the wing to the only hub, and beyond each hub the overhang."""
        overhang, lengths = self.vehicle.booms.overhang, []
        for boom in self.booms:
            if boom.front and boom.rear:
                lengths.append(hubs[..., boom.rear[0], 0] - hubs[..., boom.front[0], 0] + 2.0 * overhang)
            else:
                port = boom.rotors[0][0]
                end = points["boom_ends"][..., self._ends.index(port), 0]
                lengths.append((hubs[..., port, 0] - end).abs() + overhang)
        return torch.stack(lengths, dim=-1)


def _measures(edges: Tensor) -> SurfaceMeasures:
    """Measures of a mirrored surface from the edges (..., 2, station, 3) of its starboard half at `_STATIONS`.

    Quadrature between root and tip; y is linear along the span.
    """
    chord = torch.linalg.vector_norm(edges[..., 1, :, :] - edges[..., 0, :, :], dim=-1)
    quarter = 0.75 * edges[..., 0, :, :] + 0.25 * edges[..., 1, :, :]
    span = 2.0 * quarter[..., -1, 1]
    mean = (chord * _WEIGHTS).sum(-1)
    center = ((chord * _WEIGHTS)[..., None] * quarter).sum(-2) / mean[..., None]
    return SurfaceMeasures(
        area=span * mean,
        span=span,
        mean_chord=(chord**2 * _WEIGHTS).sum(-1) / mean,
        aerodynamic_center=center * torch.tensor([1.0, 0.0, 1.0], dtype=center.dtype),
    )
