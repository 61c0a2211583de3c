"""STEP files in and out through Open CASCADE, the `cad` extra: B-spline surfaces with their names, in metres."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from lpc_mdo.geometry.cad_kernel import CadError, require_kernel, use_metres
from lpc_mdo.geometry.surfaces import BSplineSurface

EDGE_TOLERANCE = 1e-7  # m
LARGEST_FILE = 200_000_000  # bytes


@dataclass(frozen=True)
class ImportedSurface:
    """One face of a file. A trimmed face covers only part of its surface; the surface is given within the face's box."""

    name: str
    surface: BSplineSurface  # m
    is_trimmed: bool


def write_step(surfaces: Mapping[str, BSplineSurface], file: Path) -> None:
    """Write named surfaces (no batch, m) to a STEP file (AP214) in metres; names go to the faces.

    Raises CadError without the CAD kernel or if the kernel refuses a surface, OSError if the file cannot be written.
    """
    require_kernel()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
    from OCP.TCollection import TCollection_HAsciiString

    writer = STEPControl_Writer()
    use_metres()
    faces = {}
    for name, surface in surfaces.items():
        made = BRepBuilderAPI_MakeFace(_to_kernel(surface), EDGE_TOLERANCE)
        if not made.IsDone():
            raise CadError(f"{name}: the CAD kernel makes no face of it")
        faces[name] = made.Face()
        writer.Transfer(faces[name], STEPControl_StepModelType.STEPControl_ShellBasedSurfaceModel)
    finder = writer.WS().TransferWriter().FinderProcess()
    for name, face in faces.items():
        STEPConstruct.FindEntity_s(finder, face).SetName(TCollection_HAsciiString(name))
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_name(file.name + ".partial")
    try:
        is_written = writer.Write(str(partial)) == IFSelect_ReturnStatus.IFSelect_RetDone
        # The kernel does not notice a full disk.
        if not is_written or not partial.read_bytes()[-200:].rstrip().endswith(b"END-ISO-10303-21;"):
            raise OSError(f"{file}: cannot be written")
        os.replace(partial, file)
    finally:
        partial.unlink(missing_ok=True)


def read_step(file: Path, time_limit: float = 300.0) -> list[ImportedSurface]:
    """Every face of a STEP file as a B-spline surface in metres, whatever unit the file has.

    Planes, cylinders and other analytic surfaces become rational B-splines; a face without a name takes that of its
    surface, or a number. Read in a process of its own, since damaged files crash the kernel or hold it for ever: at most
    `time_limit` s. Raises CadError where the file is missing, is no STEP file, holds no face, or brings the kernel down.
    """
    require_kernel()
    if not file.is_file():
        raise CadError(f"{file}: cannot be read: it does not exist or is not a file")
    if (size := file.stat().st_size) > LARGEST_FILE:
        raise CadError(f"{file}: cannot be read: it has {size} bytes; it must have at most {LARGEST_FILE}")
    with tempfile.TemporaryDirectory(prefix="lpc-mdo-step-") as folder:
        answer = Path(folder) / "faces.json"
        command = [sys.executable, "-m", "lpc_mdo.geometry.cad_reader", str(file.resolve()), str(answer)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)}
        try:
            quiet = subprocess.DEVNULL
            code = subprocess.run(
                command, env=environment, timeout=time_limit, stdin=quiet, stdout=quiet, stderr=quiet, check=False
            ).returncode
        except subprocess.TimeoutExpired:
            raise CadError(f"{file}: cannot be read: the CAD kernel did not end within {time_limit:g} s") from None
        if code != 0 or not answer.is_file():
            raise CadError(f"{file}: cannot be read: the CAD kernel crashed on it")
        content = json.loads(answer.read_text(encoding="utf-8"))
    if fault := content.get("fault"):
        raise CadError(f"{file}: {fault}")
    return [_imported(face, file) for face in content["faces"]]


def _imported(face: dict[str, Any], file: Path) -> ImportedSurface:
    points, u, v = (torch.tensor(face[key], dtype=torch.float64) for key in ("points", "knots_u", "knots_v"))
    weights = None if face["weights"] is None else torch.tensor(face["weights"], dtype=torch.float64)
    if not all(bool(values.isfinite().all()) for values in (points, u, v, *([] if weights is None else [weights]))):
        raise CadError(f"{file}: {face['name']} is invalid: its points, knots and weights must be finite")
    return ImportedSurface(
        face["name"], BSplineSurface(points, tuple(face["degrees"]), (u, v), weights), face["is_trimmed"]
    )


def _to_kernel(surface: BSplineSurface) -> Any:
    from OCP import collections
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    nu, nv = surface.shape
    points, weights = collections.Array2_gp_Pnt(1, nu, 1, nv), collections.Array2_double(1, nu, 1, nv)
    for i, row in enumerate(surface.control_points.detach().tolist(), start=1):
        for j, point in enumerate(row, start=1):
            points.SetValue(i, j, gp_Pnt(*point))
            weights.SetValue(i, j, 1.0 if surface.weights is None else float(surface.weights[i - 1, j - 1]))
    values, times = [], []
    for knots in surface.knots:
        distinct, counts = torch.unique(knots, return_counts=True)
        value, count = (kind(1, len(distinct)) for kind in (collections.Array1_double, collections.Array1_int))
        for i, (knot, multiplicity) in enumerate(zip(distinct.tolist(), counts.tolist(), strict=True), start=1):
            value.SetValue(i, knot)
            count.SetValue(i, multiplicity)
        values.append(value)
        times.append(count)
    if surface.weights is None:
        return Geom_BSplineSurface(points, *values, *times, *surface.degrees)
    return Geom_BSplineSurface(points, weights, *values, *times, *surface.degrees)
