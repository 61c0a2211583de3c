"""Meshes and measures of the outer mold line: camber surfaces, beams and boxes, rotor disks, wetted areas, volumes.

Points are projected onto the baseline once; what comes back are mapped arrays, which follow every design.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.geometry.mapped import MappedArray
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.projection import project_along
from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.quadrature import gauss_legendre

QUADRATURE = 8  # points between two knots


def edges(mold: OuterMoldLine, component: str, stations: Tensor) -> MappedArray:
    """Leading and trailing edge (2, station) of a starboard half at the spanwise parameters (station,) in [0, 1]."""
    ends = torch.tensor([0.0, 1.0], dtype=torch.float64)
    return mold.patches[f"{component}_upper"].at(ends, stations, mold.size)


def camber_mesh(mold: OuterMoldLine, component: str, chordwise: Tensor, spanwise: Tensor) -> MappedArray:
    """Camber surface (chordwise, spanwise) of a starboard half, between its upper and lower side.

    chordwise: fractions of the chord, from 0 to 1; spanwise: fractions of the half span in [0, 1]; any increasing
    spacing. Points of the chord plane are projected onto both sides along the normal of the root chord; half way between
    lies the camber surface. Leading and trailing edge are the surface's own. Raises ValueError where a fraction is out
    of range, ArithmeticError where a projection misses the surface.
    """
    _require_fractions("chordwise", chordwise)
    _require_fractions("spanwise", spanwise)
    inner = chordwise[(chordwise > 0.0) & (chordwise < 1.0)]
    both = [_projected_grid(mold, component, side, inner, spanwise) for side in ("upper", "lower")]
    middle = both[0].midpoint(both[1]).matrix.to_dense()
    rims = edges(mold, component, spanwise).matrix.to_dense()
    rows = []
    if float(chordwise[0]) == 0.0:
        rows.append(rims[: len(spanwise)])
    rows.append(middle)
    if float(chordwise[-1]) == 1.0:
        rows.append(rims[len(spanwise) :])
    return MappedArray(torch.cat(rows).to_sparse(), (len(chordwise), len(spanwise)))


def _require_fractions(name: str, fractions: Tensor) -> None:
    is_increasing = bool((fractions[1:] > fractions[:-1]).all())
    if not (is_increasing and bool(((fractions >= 0.0) & (fractions <= 1.0)).all())):
        raise ValueError(f"{name} is not allowed; its fractions must increase between 0 and 1")


def _projected_grid(mold: OuterMoldLine, component: str, side: str, chordwise: Tensor, spanwise: Tensor) -> MappedArray:
    """Points (chordwise, spanwise) of one side above or below the fractions of the chord."""
    patch = mold.patches[f"{component}_{side}"]
    rest = torch.cat([p.surface.control_points.flatten(0, 1) for p in mold.patches.values()])
    rims = edges(mold, component, spanwise)(rest)
    targets = rims[0] + chordwise[:, None, None] * (rims[1] - rims[0])
    chord = rims[1, 0] - rims[0, 0]
    normal = torch.linalg.cross(chord, torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64))
    found = project_along(patch.surface, targets.flatten(0, 1), normal)
    if not bool((found.is_converged & (found.distance < 1e-8)).all()):
        raise ArithmeticError(f"{patch.name}: points of the chord plane were not found on the surface")
    points = patch.points(found.u, found.v, mold.size)
    return MappedArray(points.matrix, (len(chordwise), len(spanwise)))


@dataclass(frozen=True)
class WingBox:
    """Beam of a starboard half for structural models: (..., station) of the box between two spars.

    nodes (..., station, 3) m: centre of the box; front_height, rear_height, width in m.
    """

    nodes: Tensor
    front_height: Tensor
    rear_height: Tensor
    width: Tensor


class WingBoxMesh:
    """The box between spars at the fractions `spars` of the chord, at spanwise fractions (station,)."""

    def __init__(self, mold: OuterMoldLine, component: str, spars: tuple[float, float], spanwise: Tensor) -> None:
        fractions = torch.tensor(spars, dtype=torch.float64)
        _require_fractions("spars", fractions)
        _require_fractions("spanwise", spanwise)
        self.sides = tuple(_projected_grid(mold, component, side, fractions, spanwise) for side in ("upper", "lower"))

    def __call__(self, control_points: Tensor) -> WingBox:
        """The box for all control points (..., control point, 3) of the aircraft."""
        upper, lower = self.sides
        heights = upper.distance(lower, control_points)
        middle = upper.midpoint(lower)(control_points)
        width = torch.linalg.vector_norm(middle[..., 1, :, :] - middle[..., 0, :, :], dim=-1)
        return WingBox(middle.mean(-3), heights[..., 0, :], heights[..., 1, :], width)


def rotor_mesh(mold: OuterMoldLine, rotor: str, radial: Tensor, azimuth: int) -> MappedArray:
    """Points (radial, azimuth) of a rotor disk at fractions of the radius, evenly around from the rear (lift) or top.

    Raises ValueError for a fraction outside [0, 1] or fewer than four azimuths.
    """
    _require_fractions("radial", radial)
    if azimuth < 4:
        raise ValueError(f"azimuth = {azimuth} is not allowed; it must be at least 4")
    turn = torch.arange(azimuth, dtype=torch.float64) / azimuth
    return mold.patches[f"disk_{rotor}"].at(radial, _circle_parameter(turn), mold.size)


def _circle_parameter(turn: Tensor) -> Tensor:
    """v at which the rational quarter circles of a disk have made `turn` (fraction of a full one)."""
    quarter = torch.floor(4.0 * turn)
    angle = 2.0 * torch.pi * (turn - 0.25 * quarter)
    # On the quarter with weights 1, sqrt(1/2), 1 the tangent of half the angle is sqrt(1/2) t / (1 - (1 - sqrt(1/2)) t).
    half, corner = torch.tan(0.5 * angle), 0.5**0.5
    t = half / (corner + (1.0 - corner) * half)
    return 0.25 * (quarter + t)


def _quadrature(surface: BSplineSurface) -> tuple[Tensor, Tensor, Tensor]:
    """Parameters u, v and weights, each (node,), of a quadrature between the surface's knots."""
    rules = []
    for knots, degree, count in zip(surface.knots, surface.degrees, surface.shape, strict=True):
        rules.append(gauss_legendre(torch.unique(knots[degree : count + 1]), QUADRATURE))
    (u, weight_u), (v, weight_v) = rules
    pairs = torch.cartesian_prod(u, v)
    return pairs[:, 0], pairs[:, 1], torch.outer(weight_u, weight_v).flatten()


def wetted_area(surface: BSplineSurface) -> Tensor:
    """Area (...,) of a surface in m^2; leading dimensions batch."""
    u, v, weight = _quadrature(surface)
    jet = surface.jet(u, v)
    return (torch.linalg.vector_norm(torch.linalg.cross(jet.u, jet.v), dim=-1) * weight).sum(-1)


def enclosed_volume(surfaces: list[BSplineSurface]) -> Tensor:
    """Volume (...,) in m^3 of a body closed by surfaces with du x dv outward: the flux of a third of the position."""
    total = torch.zeros((), dtype=torch.float64)
    for surface in surfaces:
        u, v, weight = _quadrature(surface)
        jet = surface.jet(u, v)
        flux = (jet.point * torch.linalg.cross(jet.u, jet.v)).sum(-1)
        total = total + (flux * weight).sum(-1) / 3.0
    return total
