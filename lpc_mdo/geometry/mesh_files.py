"""Triangles and quadrilaterals of named surfaces in files: STL for printing and meshing, VTK for ParaView."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from lpc_mdo.files.write import write_together
from lpc_mdo.geometry.surfaces import BSplineSurface

RESOLUTION = 32  # cells along each direction of a surface


@dataclass(frozen=True)
class QuadMesh:
    """points (point, 3) m; quads (cell, 4) indices, counter-clockwise seen along the normal; surface (cell,) number."""

    points: np.ndarray
    quads: np.ndarray
    surface: np.ndarray
    names: tuple[str, ...]


def quad_mesh(surfaces: Mapping[str, BSplineSurface], resolution: int = RESOLUTION) -> QuadMesh:
    """Even cells of every surface; surfaces that share an edge share its points, so closed bodies stay closed.

    Raises ValueError unless resolution >= 1.
    """
    if resolution < 1:
        raise ValueError(f"resolution = {resolution} is not allowed; it must be at least 1")
    n = resolution + 1
    corner = (np.arange(resolution)[:, None] * n + np.arange(resolution)).reshape(-1, 1)
    cells = corner + np.array([0, n, n + 1, 1])
    points = []
    for surface in surfaces.values():
        ends = [torch.linspace(low, high, n, dtype=torch.float64) for low, high in surface.domain]
        points.append(surface.grid(*ends).detach().reshape(-1, 3).numpy())
    count = len(points)
    return QuadMesh(
        points=np.concatenate(points),
        quads=np.concatenate([cells + i * n * n for i in range(count)]),
        surface=np.repeat(np.arange(count), resolution**2),
        names=tuple(surfaces),
    )


def write_stl(mesh: QuadMesh, file: Path) -> None:
    """Binary STL in metres, normals as the surfaces have them; triangles without area are left out."""
    corners = mesh.points[np.concatenate([mesh.quads[:, [0, 1, 2]], mesh.quads[:, [0, 2, 3]]])]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=-1)
    is_kept = length > 1e-14 * np.ptp(mesh.points, axis=0).max() ** 2
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles = np.zeros(int(is_kept.sum()), dtype=record)
    triangles["normal"] = normals[is_kept] / length[is_kept, None]
    triangles["corners"] = corners[is_kept]
    header = b"Lift+Cruise outer mold line, metres".ljust(80, b" ")
    file.parent.mkdir(parents=True, exist_ok=True)
    write_together({file: header + np.uint32(len(triangles)).tobytes() + triangles.tobytes()})


def write_vtk(mesh: QuadMesh, file: Path) -> None:
    """Legacy VTK polygons in metres, with the number of the surface as cell data and the names as field data."""
    cells = np.column_stack([np.full(len(mesh.quads), 4), mesh.quads])
    lines = ["# vtk DataFile Version 3.0", "Lift+Cruise outer mold line, metres", "ASCII", "DATASET POLYDATA"]
    lines += ["FIELD FieldData 1", f"surface_names 1 {len(mesh.names)} string", *mesh.names]
    lines += [f"POINTS {len(mesh.points)} double", *(" ".join(f"{x:.12g}" for x in p) for p in mesh.points)]
    lines += [f"POLYGONS {len(cells)} {cells.size}", *(" ".join(map(str, cell)) for cell in cells.tolist())]
    lines += [f"CELL_DATA {len(cells)}", "SCALARS surface int 1", "LOOKUP_TABLE default", *map(str, mesh.surface)]
    file.parent.mkdir(parents=True, exist_ok=True)
    write_together({file: ("\n".join(lines) + "\n").encode("ascii")})
