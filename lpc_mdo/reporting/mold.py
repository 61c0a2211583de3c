"""The outer mold line of a design as figures draw it: grids of points on its surfaces, camber meshes and measures."""

from typing import Any

import torch
from torch import Tensor

from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.geometry.shape import Geometry, SurfaceMeasures

DECIMALS = 3  # of coordinates in m: a millimetre is a tenth of a line's width
CELLS = {"fuselage": (40, 40), "wing": (16, 8), "horizontal_tail": (16, 5), "vertical_tail": (16, 5)}
TUBE_CELLS = (12, 16)
RIM_CELLS = 72


def mold_data(geometry: Geometry, parameters: ShapeParameters) -> dict[str, Any]:
    """Points (..., 3) m of one design without batch.

    surfaces: grids (u, v, 3) by component; disks: rims (point, 3) by rotor; wing_mesh, tail_mesh: camber surfaces
    (chordwise + 1, spanwise + 1, 3) of the starboard half; wing, tail, fuselage, hubs_m, rotor_radius_m: measures.
    """
    mold = geometry.outer_mold_line
    with torch.no_grad():
        control_points = mold.control_points(parameters)
        found, shape = mold.surfaces(control_points), geometry(parameters)
        tip = geometry.arrays["wing_edges"](control_points)[:, -1]
    surfaces: dict[str, list[Tensor]] = {}
    disks = {}
    for component, names in mold.components.items():
        if component.startswith("disk_"):
            disks[component.removeprefix("disk_")] = _grid(found[names[0]], 1, RIM_CELLS)[-1]
            continue
        cells = CELLS.get(component, TUBE_CELLS)
        surfaces[component] = [_grid(found[name], *cells) for name in names]
    body = geometry.vehicle.fuselage
    return {
        "surfaces": surfaces,
        "disks": disks,
        "wing_mesh": _rounded(shape.wing_mesh),
        "tail_mesh": _rounded(shape.tail_mesh),
        "wing": _measures(shape.wing) | {"tip_m": tip},
        "tail": _measures(shape.tail),
        "fuselage": {
            "nose_m": body.nose,
            "length_m": body.length,
            "width_m": body.width,
            "height_m": body.height,
            "roof_m": mold.roof_height,
        },
        "rotors": [rotor.name for rotor in geometry.vehicle.rotors],
        "hubs_m": shape.hubs,
        "rotor_radius_m": parameters.rotor_radius,
    }


def _grid(surface: Any, u_cells: int, v_cells: int) -> Tensor:
    """Points (u, v, 3) of a surface at even parameters."""
    ends = [
        torch.linspace(low, high, cells + 1, dtype=torch.float64)
        for (low, high), cells in zip(surface.domain, (u_cells, v_cells), strict=True)
    ]
    return _rounded(surface.grid(*ends))


def _rounded(points: Tensor) -> Tensor:
    return points.detach().round(decimals=DECIMALS)


def _measures(surface: SurfaceMeasures) -> dict[str, Tensor]:
    return {
        "area_m2": surface.area,
        "aspect_ratio": surface.aspect_ratio,
        "span_m": surface.span,
        "mean_chord_m": surface.mean_chord,
        "aerodynamic_center_m": surface.aerodynamic_center,
    }
