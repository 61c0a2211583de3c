"""Measures of the mapped geometry against closed forms and another quadrature."""

import math
from dataclasses import replace

import numpy as np
import torch
from scipy.special import ellipe

from lpc_mdo.config import load
from lpc_mdo.geometry.bodies import disk_surface
from lpc_mdo.geometry.meshing import wetted_area
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.verification.comparison import Between, Comparison

MODEL = "geometry"
AREA, ASPECT_RATIO = 21.5, 10.5  # m^2, 1: a wing other than the baseline's


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        return [_trapezoid(), *_bodies()]


def _trapezoid() -> Comparison:
    vehicle, _ = load()
    geometry = Geometry(vehicle)
    design = replace(
        geometry.outer_mold_line.baseline_parameters(),
        wing_area=torch.tensor(AREA, dtype=torch.float64),
        wing_aspect_ratio=torch.tensor(ASPECT_RATIO, dtype=torch.float64),
    )
    wing, taper = geometry(design).wing, vehicle.wing.taper
    span = math.sqrt(AREA * ASPECT_RATIO)
    root = 2.0 * AREA / (span * (1.0 + taper))
    mean = 2.0 / 3.0 * root * (1.0 + taper + taper**2) / (1.0 + taper)
    y = span / 6.0 * (1.0 + 2.0 * taper) / (1.0 + taper)
    aft = vehicle.wing.root_quarter_chord[0] + math.tan(vehicle.wing.quarter_chord_sweep) * y
    ours = [wing.area, wing.span, wing.mean_chord, wing.aerodynamic_center[0]]
    return Between(MODEL, "trapezoid in closed form").relative(
        "area m^2, span, mean chord and place of the aerodynamic centre m of a resized wing", [float(v) for v in ours],
        [AREA, span, mean, aft], 1e-10, "rounding",
    )  # fmt: skip


def _bodies() -> list[Comparison]:
    vehicle, _ = load()
    mold = OuterMoldLine(vehicle)
    body = mold.surfaces(mold.control_points(mold.baseline_parameters()))["fuselage"]
    center, first, second = (
        torch.tensor(v, dtype=torch.float64) for v in ([1.0, 2.0, 3.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    )
    disk = disk_surface(center, 1.524, first, second)
    around = torch.linspace(0.0, 1.0, 4001, dtype=torch.float64)
    ring = body.grid(torch.tensor([0.4], dtype=torch.float64), around)[0]
    girth = torch.linalg.vector_norm(ring.diff(dim=0), dim=-1).sum()
    a, b = 0.5 * vehicle.fuselage.height, 0.5 * vehicle.fuselage.width
    grid = body.grid(*(torch.linspace(0.0, 1.0, n, dtype=torch.float64) for n in (321, 289))).numpy()
    p, q, r, s = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    triangles = sum(np.linalg.norm(np.cross(v - u, w - u), axis=-1).sum() / 2.0 for u, v, w in ((p, q, r), (p, r, s)))
    return [
        Between(MODEL, "closed form").relative(
            "area of a rotor disk, m^2", wetted_area(disk), math.pi * 1.524**2, 1e-9, "quadrature"
        ),
        Between(MODEL, "complete elliptic integral").relative(
            "girth of the cabin, m", girth, 4.0 * a * ellipe(1.0 - (b / a) ** 2), 1e-6, "polygon of 4000 sides"
        ),
        Between(MODEL, "185 000 flat triangles").relative(
            "wetted area of the fuselage, m^2", wetted_area(body), triangles, 2e-4, "flat triangles lie inside"
        ),
    ]
