"""Silhouettes of the aircraft in three views, as polygons in metres, off the same control points as the meshes."""

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.model.design import Design, shape_parameters

Array = NDArray[np.float64]
VIEWS = {"top": [1, 0], "front": [1, 2], "side": [0, 2]}  # axes across and up the page; x aft, y starboard, z up
CHORDWISE = torch.linspace(0.0, 1.0, 25, dtype=torch.float64)
SPANWISE = torch.linspace(0.0, 1.0, 13, dtype=torch.float64)
ALONG = torch.linspace(0.0, 1.0, 61, dtype=torch.float64)
AROUND = torch.linspace(0.0, 1.0, 49, dtype=torch.float64)


def outlines(geometry: Geometry, design: Design) -> dict[str, dict[str, list[Array]]]:
    """Polygons (k, 2) m by view and component; a component of several bodies has several. `design` has no batch."""
    mold = geometry.outer_mold_line
    with torch.no_grad():
        surfaces = mold.surfaces(mold.control_points(shape_parameters(design)))

        def sections(*names: str) -> Array:
            """Points (spanwise, around, 3) of a half surface, both sides."""
            return np.concatenate([surfaces[name].grid(CHORDWISE, SPANWISE).numpy() for name in names]).swapaxes(0, 1)

        rings = surfaces["fuselage"].grid(ALONG, AROUND).numpy()
        wing, tail = (_mirrored(sections(f"{name}_upper", f"{name}_lower")) for name in ("wing", "horizontal_tail"))
        fin = sections("vertical_tail_starboard", "vertical_tail_port")
        booms = [surfaces[name].grid(AROUND, AROUND).numpy() for name in surfaces if name.startswith("boom_")]

    def view(axes: list[int]) -> dict[str, list[Array]]:
        is_lengthwise = axes == VIEWS["side"]
        surface = _hull if is_lengthwise else lambda points: _strip(points, across=1)
        body = _hull if axes == VIEWS["front"] else lambda points: _strip(points, across=int(is_lengthwise))
        return {
            "booms": [_hull(boom[..., axes]) for boom in booms],
            "wing": [surface(wing[..., axes])],
            "horizontal_tail": [surface(tail[..., axes])],
            "fuselage": [body(rings[..., axes])],
            "vertical_tail": [_hull(fin[..., axes])],
        }

    return {name: view(axes) for name, axes in VIEWS.items()}


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
