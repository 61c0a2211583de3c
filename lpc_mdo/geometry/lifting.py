"""Wing, horizontal tail and fin as they stand in the vehicle file: trapezoids with NACA sections, closed by caps."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.airfoils.sections import section_control_points, symmetric_control_points
from lpc_mdo.config import LiftingSurface, VerticalTail
from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.bsplines import greville_abscissae

SECTION_POINTS = 13  # fits the camber line of a NACA four-digit section to 2e-4 of the chord
SECTION_DEGREE = 3
SPAN_POINTS = 5  # one row per twist variable
SPAN_DEGREE = 3


@dataclass(frozen=True)
class Trapezoid:
    """Rows of control points of a starboard half: quarter chords (row, 3) m, chords (row,) m, half span in m."""

    quarter_chord: Tensor
    chord: Tensor
    half_span: float


def trapezoid(surface: LiftingSurface) -> Trapezoid:
    """The half of a wing or horizontal tail. Rows stand where straight edges stay straight: at Greville's abscissae."""
    half_span = 0.5 * math.sqrt(surface.area * surface.aspect_ratio)
    rows = torch.from_numpy(greville_abscissae(SPAN_POINTS, SPAN_DEGREE))
    root_chord = surface.area / (half_span * (1.0 + surface.taper))
    slopes = [math.tan(surface.quarter_chord_sweep), 1.0, math.tan(surface.dihedral)]
    root = torch.tensor(surface.root_quarter_chord, dtype=torch.float64)
    line = root + half_span * rows[:, None] * torch.tensor(slopes, dtype=torch.float64)
    return Trapezoid(line, root_chord * (1.0 - (1.0 - surface.taper) * rows), half_span)


def half_surface(surface: LiftingSurface) -> dict[str, BSplineSurface]:
    """Upper and lower side and tip cap of the starboard half; u from leading to trailing edge, v from root to tip.

    Sections lie in planes y = const, scale with the chord and turn about their quarter chord by the incidence.
    """
    plan = trapezoid(surface)
    cos, sin = math.cos(surface.incidence), math.sin(surface.incidence)
    sides = []
    for side in section_control_points(surface.airfoil, SECTION_POINTS, SECTION_DEGREE):
        along, up = (torch.from_numpy(side) - torch.tensor([0.25, 0.0])).unbind(-1)
        section = torch.stack([along * cos + up * sin, torch.zeros_like(up), up * cos - along * sin], dim=-1)
        sides.append(plan.quarter_chord + section[:, None, :] * plan.chord[:, None])
    return {
        "upper": BSplineSurface.clamped(sides[0], (SECTION_DEGREE, SPAN_DEGREE)),
        "lower": BSplineSurface.clamped(sides[1], (SECTION_DEGREE, SPAN_DEGREE)),
        "tip": _cap(sides[0][:, -1], sides[1][:, -1]),
    }


def fin_surface(fin: VerticalTail) -> dict[str, BSplineSurface]:
    """Starboard and port side of the fin and its caps; unswept quarter chord, span upward."""
    rows = torch.from_numpy(greville_abscissae(SPAN_POINTS, SPAN_DEGREE))
    height = math.sqrt(fin.area * fin.aspect_ratio)
    chord = 2.0 * fin.area / (height * (1.0 + fin.taper)) * (1.0 - (1.0 - fin.taper) * rows)
    root = torch.tensor(fin.root_quarter_chord, dtype=torch.float64)
    sides = []
    for side in symmetric_control_points(fin.thickness_to_chord, SECTION_POINTS, SECTION_DEGREE):
        along, out = torch.from_numpy(side)[:, :, None].unbind(1)
        points = [(along - 0.25) * chord, out * chord, (height * rows).expand(SECTION_POINTS, -1)]
        sides.append(root + torch.stack(points, dim=-1))
    starboard, port = sides
    return {
        "starboard": BSplineSurface.clamped(starboard, (SECTION_DEGREE, SPAN_DEGREE)),
        "port": BSplineSurface.clamped(port, (SECTION_DEGREE, SPAN_DEGREE)),
        "tip": _cap(port[:, -1], starboard[:, -1]),
        "root": _cap(starboard[:, 0], port[:, 0]),
    }


def _cap(first: Tensor, second: Tensor) -> BSplineSurface:
    """The ruled surface between the two sides (point, 3) of a section."""
    return BSplineSurface.clamped(torch.stack([first, second], dim=1), (SECTION_DEGREE, 1))
