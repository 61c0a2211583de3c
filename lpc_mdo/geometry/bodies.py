"""Closed bodies with elliptical sections, and disks: rational B-spline surfaces that carry circles exactly."""

import math

import torch
from torch import Tensor

from lpc_mdo.config import Fuselage
from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.bsplines import clamped_knots

# Rows of the fuselage along its length: place, width and height as fractions, all ASSUMED: rounded nose, cabin of constant
# section over a third of the length, tail cone under a level roof, rounded end.
FUSELAGE_STATION = (0.0, 0.0, 0.07, 0.16, 0.26, 0.38, 0.50, 0.68, 0.84, 0.95, 1.0, 1.0)
FUSELAGE_WIDTH = (0.0, 0.45, 0.85, 1.0, 1.0, 1.0, 1.0, 0.74, 0.40, 0.17, 0.08, 0.0)
FUSELAGE_HEIGHT = (0.0, 0.40, 0.82, 1.0, 1.0, 1.0, 1.0, 0.66, 0.36, 0.18, 0.08, 0.0)
CABIN_END = 0.50  # behind it the axis rises on a straight line to the rear point

# Rows of booms and hubs: rounded ends.
TUBE_STATION = (0.0, 0.0, 0.05, 0.35, 0.65, 0.95, 1.0, 1.0)
TUBE_RADIUS = (0.0, 0.7, 1.0, 1.0, 1.0, 1.0, 0.7, 0.0)


def elliptical_body(
    center: Tensor, half_width: Tensor, half_height: Tensor, across: Tensor, up: Tensor, degree: int
) -> BSplineSurface:
    """Surface whose sections are ellipses: center (row, 3), half axes (row,) along the unit vectors across, up (3,).

    u runs along the rows, v once around from `up` by way of `across`; the seam v = 0, 1 is closed point by point. The
    circle is the quadratic with nine control points: Piegl and Tiller, The NURBS Book (1997), example 7.4.
    """
    corner = math.sqrt(0.5)
    sine = torch.tensor([0, 1, 1, 1, 0, -1, -1, -1, 0], dtype=torch.float64)
    cosine = torch.tensor([1, 1, 0, -1, -1, -1, 0, 1, 1], dtype=torch.float64)
    around = torch.tensor([1, corner] * 4 + [1], dtype=torch.float64)
    knots = torch.tensor([0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1], dtype=torch.float64)
    offset_across = (half_width[:, None] * sine)[..., None] * across
    offset_up = (half_height[:, None] * cosine)[..., None] * up
    points = center[:, None, :] + offset_across + offset_up
    rows = torch.from_numpy(clamped_knots(len(center), degree))
    return BSplineSurface(points, (degree, 2), (rows, knots), around.expand(len(center), -1))


def fuselage_surface(body: Fuselage, roof_height: float) -> BSplineSurface:
    """The fuselage: published length, height and width, through the published nose and rear points.

    The stated length is 2 % more than the distance from nose to rear point; the rounded end makes up the rest. The roof
    of the cabin stands at z = roof_height (m), which puts it under the wing. Sections are ellipses, ASSUMED.
    """
    station = torch.tensor(FUSELAGE_STATION, dtype=torch.float64)
    nose, rear = body.nose, body.rear
    cabin_axis = roof_height - 0.5 * body.height
    x = nose[0] + body.length * station
    cabin_end = nose[0] + body.length * CABIN_END
    rise = (rear[2] - cabin_axis) / (rear[0] - cabin_end)
    z = cabin_axis + rise * (x - cabin_end).clamp(min=0.0)
    z[:2] = nose[2]
    return elliptical_body(
        center=torch.stack([x, torch.full_like(x, nose[1]), z], dim=-1),
        half_width=0.5 * body.width * torch.tensor(FUSELAGE_WIDTH, dtype=torch.float64),
        half_height=0.5 * body.height * torch.tensor(FUSELAGE_HEIGHT, dtype=torch.float64),
        across=torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64),
        up=torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64),
        degree=3,
    )


def tail_cone_slope(body: Fuselage, roof_height: float) -> float:
    """dz/dx of the straight axis behind the cabin."""
    return (body.rear[2] - roof_height + 0.5 * body.height) / (body.rear[0] - body.nose[0] - body.length * CABIN_END)


def tube_surface(start: Tensor, end: Tensor, radius: float) -> BSplineSurface:
    """A round tube with rounded ends from `start` to `end`, each (3,) m."""
    axis = torch.nn.functional.normalize(end - start, dim=0)
    least = torch.zeros(3, dtype=torch.float64)
    least[int(axis.abs().argmin())] = 1.0
    up = torch.nn.functional.normalize(least - (least @ axis) * axis, dim=0)
    station = torch.tensor(TUBE_STATION, dtype=torch.float64)[:, None]
    half = radius * torch.tensor(TUBE_RADIUS, dtype=torch.float64)
    return elliptical_body(start + station * (end - start), half, half, torch.linalg.cross(up, axis), up, degree=3)


def disk_surface(center: Tensor, radius: float, across: Tensor, up: Tensor) -> BSplineSurface:
    """A flat round disk; u runs from center to rim, and du x dv points along up x across."""
    half = torch.tensor([0.0, radius], dtype=torch.float64)
    return elliptical_body(center.expand(2, 3), half, half, across, up, degree=1)


def fuselage_sections(
    body: Fuselage, roof_height: float, count: int = 48
) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """Sections of the fuselage's surface, each (count,) m: x, y and z of the center, half width, half height.

    Denser towards nose and rear, where it is round.
    """
    surface = fuselage_surface(body, roof_height)
    u = 0.5 * (1.0 - torch.cos(torch.linspace(0.0, math.pi, count, dtype=torch.float64)))
    top, side, bottom = (surface(u, torch.full_like(u, v)) for v in (0.0, 0.25, 0.5))
    center = 0.5 * (top + bottom)
    return center[:, 0], center[:, 1], center[:, 2], side[:, 1] - center[:, 1], 0.5 * (top - bottom)[:, 2]
