"""What the disciplines need of the geometry: meshes, hub points, areas, spans and arms, all off the control points."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.geometry.mapped import MappedArray, stack
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine, ShapeParameters

WING_PANELS = (4, 8)  # chordwise, spanwise per half; docs/models.md gives the mesh error
TAIL_PANELS = (2, 5)


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
    boom_length: Tensor  # (..., boom pair)
    fuselage_wetted_area: Tensor  # ()


class Geometry:
    """Outer mold line with its mapped arrays, built once for a vehicle."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.vehicle = vehicle
        self.outer_mold_line = OuterMoldLine(vehicle)
        self.wing_camber = self._camber("wing", WING_PANELS)
        self.tail_camber = self._camber("horizontal_tail", TAIL_PANELS)
        self.wing_edges = self._edges("wing")
        self.tail_edges = self._edges("horizontal_tail")
        baseline = self.outer_mold_line.control_points(self.outer_mold_line.baseline_parameters())
        fuselage = self._grid("fuselage", torch.linspace(0, 1, 61), torch.linspace(0, 1, 49))
        self.fuselage_wetted_area = _grid_area(fuselage(baseline))  # nothing moves it
        origin = torch.zeros(1, dtype=torch.float64)
        self.hubs = stack([self._grid(f"hub_{rotor.name}", origin, origin) for rotor in vehicle.rotors])

    def _grid(self, name: str, u: Tensor, v: Tensor) -> MappedArray:
        return self.outer_mold_line.patches[name].at(u.double(), v.double(), self.outer_mold_line.size)

    def _mean_surface(self, name: str, u: Tensor, v: Tensor) -> MappedArray:
        return 0.5 * (self._grid(f"{name}_upper", u, v) + self._grid(f"{name}_lower", u, v))

    def _camber(self, name: str, panels: tuple[int, int]) -> MappedArray:
        """Uniform panels, the outermost ending a quarter of its width inside the tip.

        With this inset eight panels per half wing give the induced drag at a given lift to 0.5 %, where panels up to
        the tip miss 6 %. Source: Hough, Remarks on Vortex-Lattice Methods, J. Aircraft 10 (1973).
        """
        chordwise = torch.sqrt(torch.linspace(0.0, 1.0, panels[0] + 1, dtype=torch.float64))  # sections carry x/c = u^2
        spanwise = torch.arange(panels[1] + 1, dtype=torch.float64) / (panels[1] + 0.25)
        return self._mean_surface(name, chordwise, spanwise)

    def _edges(self, name: str) -> MappedArray:
        """Leading and trailing edge at 41 spanwise parameters, (2, 41)."""
        return self._mean_surface(name, torch.tensor([0.0, 1.0]), torch.linspace(0, 1, 41))

    def __call__(self, parameters: ShapeParameters) -> Shape:
        """The aircraft's shape for the given parameters; every output is a smooth function of them."""
        points = self.outer_mold_line.control_points(parameters)
        tail_edges = self.tail_edges(points)
        hubs = self.hubs(points)
        root = tail_edges[..., 0, :]
        front, rear = hubs[..., 0:4:2, 0], hubs[..., 1:4:2, 0]
        return Shape(
            wing_mesh=self.wing_camber(points),
            tail_mesh=self.tail_camber(points),
            tail_hinge=0.75 * root[..., 0, :] + 0.25 * root[..., 1, :],
            wing=_measures(self.wing_edges(points)),
            tail=_measures(tail_edges),
            hubs=hubs,
            boom_length=rear - front + 2.0 * self.vehicle.booms.overhang,
            fuselage_wetted_area=self.fuselage_wetted_area,
        )


def _measures(edges: Tensor) -> SurfaceMeasures:
    """Measures of a mirrored surface from the edges (..., 2, station, 3) of its starboard half.

    The chord is linear between stations, so Simpson's rule per strip is exact for area and mean chord.
    """
    chord = torch.linalg.vector_norm(edges[..., 1, :, :] - edges[..., 0, :, :], dim=-1)
    quarter = 0.75 * edges[..., 0, :, :] + 0.25 * edges[..., 1, :, :]
    step = quarter[..., 1:, 1] - quarter[..., :-1, 1]
    inner, outer = chord[..., :-1], chord[..., 1:]
    half_area = (step * (inner + outer) / 2).sum(-1)
    second = (step * (inner**2 + inner * outer + outer**2) / 3).sum(-1)
    middle = (
        step[..., None]
        * (quarter[..., :-1, :] * (2 * inner + outer)[..., None] + quarter[..., 1:, :] * (inner + 2 * outer)[..., None])
        / 6
    ).sum(-2)
    center = middle / half_area[..., None]
    return SurfaceMeasures(
        area=2.0 * half_area,
        span=2.0 * quarter[..., -1, 1],
        mean_chord=second / half_area,
        aerodynamic_center=center * torch.tensor([1.0, 0.0, 1.0], dtype=center.dtype),
    )


def _grid_area(points: Tensor) -> Tensor:
    """Area (...,) of a surface given on a grid (..., u, v, 3): half the cross product of each cell's diagonals."""
    first = points[..., 1:, 1:, :] - points[..., :-1, :-1, :]
    second = points[..., 1:, :-1, :] - points[..., :-1, 1:, :]
    return 0.5 * torch.linalg.vector_norm(torch.linalg.cross(first, second), dim=-1).sum((-1, -2))


def rotate_about_hinge(mesh: Tensor, hinge: Tensor, angle: Tensor) -> Tensor:
    """The mesh (..., c, s, 3) turned by `angle` (...,) rad, trailing edge down, about y through `hinge` (..., 3)."""
    arm = mesh - hinge[..., None, None, :]
    cos, sin = torch.cos(angle)[..., None, None], torch.sin(angle)[..., None, None]
    x = arm[..., 0] * cos + arm[..., 2] * sin
    z = arm[..., 2] * cos - arm[..., 0] * sin
    x, y, z = torch.broadcast_tensors(x, arm[..., 1], z)
    return torch.stack([x, y, z], dim=-1) + hinge[..., None, None, :]
