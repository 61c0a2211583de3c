"""Silhouettes of the aircraft in three views, as polygons in metres, off the same control points as the meshes."""

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from lpc_mdo.design import Design
from lpc_mdo.geometry.outer_mold_line import ShapeParameters
from lpc_mdo.geometry.shape import Geometry

Array = NDArray[np.float64]
VIEWS = {"top": [1, 0], "front": [1, 2], "side": [0, 2]}  # axes across and up the page; x aft, y starboard, z up
CHORDWISE = torch.linspace(0.0, 1.0, 25, dtype=torch.float64)
SPANWISE = torch.linspace(0.0, 1.0, 13, dtype=torch.float64)
ALONG = torch.linspace(0.0, 1.0, 61, dtype=torch.float64)
AROUND = torch.linspace(0.0, 1.0, 49, dtype=torch.float64)


def outlines(geometry: Geometry, design: Design) -> dict[str, dict[str, list[Array]]]:
    """Polygons (k, 2) m by view and component; a component of several bodies has several. `design` has no batch."""
    mold, booms = geometry.outer_mold_line, geometry.vehicle.booms
    with torch.no_grad():
        points = mold.control_points(_shape_parameters(design))

        def grid(patch: str, u: torch.Tensor, v: torch.Tensor) -> Array:
            return mold.patches[patch].at(u, v, mold.size)(points).numpy()

        def sections(surface: str) -> Array:
            """Points (spanwise, around, 3) of a half surface, upper and lower side."""
            sides = [grid(f"{surface}_{side}", CHORDWISE, SPANWISE) for side in ("upper", "lower")]
            return np.concatenate(sides).swapaxes(0, 1)

        rings, fin = grid("fuselage", ALONG, AROUND), sections("vertical_tail")
        wing, tail = _mirrored(sections("wing")), _mirrored(sections("horizontal_tail"))
        tubes = _booms(geometry.hubs(points).numpy(), booms.diameter, booms.overhang)

    def view(axes: list[int]) -> dict[str, list[Array]]:
        is_lengthwise = axes == VIEWS["side"]
        surface = _hull if is_lengthwise else lambda points: _strip(points, across=1)
        body = _hull if axes == VIEWS["front"] else lambda points: _strip(points, across=int(is_lengthwise))
        return {
            "booms": [_hull(tube[..., axes]) for tube in tubes],
            "wing": [surface(wing[..., axes])],
            "horizontal_tail": [surface(tail[..., axes])],
            "fuselage": [body(rings[..., axes])],
            "vertical_tail": [_hull(fin[..., axes])],
        }

    return {name: view(axes) for name, axes in VIEWS.items()}


def _shape_parameters(design: Design) -> ShapeParameters:
    return ShapeParameters(
        wing_area=design.wing_area,
        wing_aspect_ratio=design.wing_aspect_ratio,
        wing_twist=design.wing_twist,
        tail_area=design.tail_area,
        tail_aspect_ratio=design.tail_aspect_ratio,
        tail_position=design.tail_position,
    )


def _hull(points: Array) -> Array:
    """Convex outline (k, 2) of points (..., 2)."""
    flat = points.reshape(-1, 2)
    return flat[ConvexHull(flat).vertices]


def _mirrored(half: Array) -> Array:
    """Sections (spanwise, around, 3) of a starboard half and its image, from tip to tip."""
    return np.concatenate([half[::-1] * np.array([1.0, -1.0, 1.0]), half])


def _strip(sections: Array, across: int) -> Array:
    """Outline (k, 2) of sections (section, around, 2) in a row: the extremes of each in coordinate `across`."""
    index = np.arange(len(sections))
    low = sections[index, sections[..., across].argmin(1)]
    high = sections[index, sections[..., across].argmax(1)]
    return np.concatenate([low, high[::-1]])


def _booms(hubs: Array, diameter: float, overhang: float) -> list[Array]:
    """Points (k, 3) m on the four booms: tubes through the hubs of a front and a rear lift rotor."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = 0.5 * diameter * np.stack([0.0 * angle, np.cos(angle), np.sin(angle)], axis=-1)
    tubes = []
    for front, rear in zip(hubs[0:8:2], hubs[1:8:2], strict=True):
        beyond = overhang * (rear - front) / np.linalg.norm(rear - front)
        tubes.append(np.concatenate([front - beyond + ring, rear + beyond + ring]))
    return tubes
