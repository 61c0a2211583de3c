"""STEP files in and out through Open CASCADE, the `cad` extra: B-spline surfaces with their names, in metres."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.geometry.surfaces import BSplineSurface

EDGE_TOLERANCE = 1e-7  # m
BORDER = 1e-6  # of the box of parameters: how close to its border an edge of an untrimmed face stays


class CadError(ValueError):
    """A file that holds no usable geometry, or no CAD kernel to read it with."""


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
    _require_kernel()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPConstruct import STEPConstruct
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
    from OCP.TCollection import TCollection_HAsciiString

    writer = STEPControl_Writer()
    _use_metres()
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
    if writer.Write(str(file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise OSError(f"{file}: cannot be written")


def read_step(file: Path) -> list[ImportedSurface]:
    """Every face of a STEP file as a B-spline surface in metres, whatever unit the file has.

    Planes, cylinders and other analytic surfaces become rational B-splines; a face without a name takes that of its
    surface, or a number. Raises CadError where the file is missing, is no STEP file, or holds no face.
    """
    _require_kernel()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    if not file.is_file():
        raise CadError(f"{file}: cannot be read: it does not exist or is not a file")
    reader = STEPControl_Reader()
    _use_metres()
    if reader.ReadFile(str(file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise CadError(f"{file}: is not a STEP file that can be read")
    reader.SetSystemLengthUnit(1000.0)  # mm in the unit of the coordinates
    reader.TransferRoots()
    found: list[ImportedSurface] = []
    if reader.NbShapes() > 0:
        explorer = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_FACE)
        while explorer.More():
            face = TopoDS.Face(explorer.Current())
            name = _face_name(reader, face) or f"surface {len(found) + 1}"
            convert = BRepBuilderAPI_NurbsConvert(face, True)
            found.append(_imported(name, TopoDS.Face(convert.Shape())))
            explorer.Next()
    if not found:
        raise CadError(f"{file}: holds no surface")
    return found


def _require_kernel() -> None:
    try:
        from OCP.Message import Message
    except ImportError:
        raise CadError("STEP files need the CAD kernel; install it with: pip install 'lpc-mdo[cad]'") from None
    messenger = Message.DefaultMessenger_s()
    for printer in list(messenger.Printers()):  # its statistics do not belong on our output
        messenger.RemovePrinter(printer)


def _use_metres() -> None:
    """The kernel's coordinates and its files in metres; settings exist once a reader or writer does."""
    from OCP.Interface import Interface_Static

    for setting in ("xstep.cascade.unit", "write.step.unit"):
        if not Interface_Static.SetCVal_s(setting, "M"):
            raise CadError(f"the CAD kernel does not take the setting {setting}")


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


def _imported(name: str, face: Any) -> ImportedSurface:
    """The surface of a face, cut to the face's box of parameters."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools
    from OCP.Geom import Geom_RectangularTrimmedSurface
    from OCP.GeomConvert import GeomConvert

    box = BRepTools.UVBounds_s(face)
    spline = GeomConvert.SurfaceToBSplineSurface_s(Geom_RectangularTrimmedSurface(BRep_Tool.Surface_s(face), *box))
    spline.SetUNotPeriodic()
    spline.SetVNotPeriodic()
    return ImportedSurface(name, _from_kernel(spline), _is_trimmed(face, box))


def _is_trimmed(face: Any, box: tuple[float, float, float, float]) -> bool:
    """Whether an edge of the face leaves the border of its box of parameters."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    u0, u1, v0, v1 = box
    explorer = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_EDGE)
    while explorer.More():
        curve = BRepAdaptor_Curve2d(TopoDS.Edge(explorer.Current()), face)
        first, last = curve.FirstParameter(), curve.LastParameter()
        for share in (0.11, 0.37, 0.5, 0.83):
            point = curve.Value(first + share * (last - first))
            across = min(abs(point.X() - u) for u in (u0, u1)) / (u1 - u0)
            along = min(abs(point.Y() - v) for v in (v0, v1)) / (v1 - v0)
            if min(across, along) > BORDER:
                return True
        explorer.Next()
    return False


def _from_kernel(spline: Any) -> BSplineSurface:
    counts = (spline.NbUPoles(), spline.NbVPoles())
    grid = [[spline.Pole(i + 1, j + 1) for j in range(counts[1])] for i in range(counts[0])]
    points = torch.tensor([[[p.X(), p.Y(), p.Z()] for p in row] for row in grid], dtype=torch.float64)
    weights = None
    if spline.IsURational() or spline.IsVRational():
        values = [[spline.Weight(i + 1, j + 1) for j in range(counts[1])] for i in range(counts[0])]
        weights = torch.tensor(values, dtype=torch.float64)
    knots = (
        _knots(spline.NbUKnots(), spline.UKnot, spline.UMultiplicity),
        _knots(spline.NbVKnots(), spline.VKnot, spline.VMultiplicity),
    )
    return BSplineSurface(points, (spline.UDegree(), spline.VDegree()), knots, weights)


def _knots(count: int, value: Any, multiplicity: Any) -> Tensor:
    return torch.tensor(
        [value(i) for i in range(1, count + 1) for _ in range(multiplicity(i))],
        dtype=torch.float64,
    )


def _face_name(reader: Any, face: Any) -> str:
    """Name of the face's entity in the file, or of its surface."""
    entity = reader.WS().TransferReader().EntityFromShapeResult(face, 1)
    for item in (entity, entity.FaceGeometry() if hasattr(entity, "FaceGeometry") else None):
        label = item.Name() if hasattr(item, "Name") else None
        if label is not None and label.ToCString():
            return label.ToCString()
    return ""
