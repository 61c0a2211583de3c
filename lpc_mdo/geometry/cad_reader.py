"""The child process in which STEP files are read: faces as B-splines to a JSON file, or what is wrong in a sentence.

    python -m lpc_mdo.geometry.cad_reader FILE.step ANSWER.json

Damaged files bring the kernel down, or make it compute or take memory without end; here they take nothing with them.
"""

import ctypes
import json
import resource
import signal
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from lpc_mdo.geometry.cad import CadError, require_kernel, use_metres

BORDER = 1e-6  # of the box of parameters: how close to its border an edge of an untrimmed face stays
WHOLE = 1e-9  # of a period: what a face may lack of it and still be closed
LARGEST_MEMORY = 8 * 1024**3  # bytes
MOST_POLES = 2_000_000
PR_SET_PDEATHSIG = 1


def read_faces(file: Path) -> list[dict[str, Any]]:
    """Faces of a STEP file: name, control points, weights, knots, degrees, is_trimmed. Raises CadError."""
    require_kernel()
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    reader = STEPControl_Reader()
    use_metres()
    if reader.ReadFile(str(file)) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise CadError("cannot be read: it is not a STEP file, or damaged")
    reader.SetSystemLengthUnit(1000.0)  # mm in the unit of the coordinates
    reader.TransferRoots()
    found: list[dict[str, Any]] = []
    poles = 0
    if reader.NbShapes() > 0:
        explorer = TopExp_Explorer(reader.OneShape(), TopAbs_ShapeEnum.TopAbs_FACE)
        while explorer.More():
            face = TopoDS.Face(explorer.Current())
            name = _face_name(reader, face) or f"surface {len(found) + 1}"
            try:
                found.append(_face(name, TopoDS.Face(BRepBuilderAPI_NurbsConvert(face, True).Shape())))
            except Exception as error:  # the kernel's own, of many kinds
                raise CadError(
                    f"{name} is invalid: the CAD kernel makes no B-spline of it ({type(error).__name__})"
                ) from None
            poles += len(found[-1]["points"]) * len(found[-1]["points"][0])
            if poles > MOST_POLES:
                raise CadError(f"more than {MOST_POLES} control points are invalid: it must hold fewer")
            explorer.Next()
    if not found:
        raise CadError("is invalid: it must hold a surface")
    return found


def _face(name: str, face: Any) -> dict[str, Any]:
    """The surface of a face, cut to the face's box of parameters."""
    from OCP.BRepTools import BRepTools

    box = BRepTools.UVBounds_s(face)
    spline = _segment(face, box)
    rows, columns = spline.NbUPoles(), spline.NbVPoles()
    grid = [[spline.Pole(i + 1, j + 1) for j in range(columns)] for i in range(rows)]
    weights = None
    if spline.IsURational() or spline.IsVRational():
        weights = [[spline.Weight(i + 1, j + 1) for j in range(columns)] for i in range(rows)]
    return {
        "name": name,
        "points": [[[p.X(), p.Y(), p.Z()] for p in row] for row in grid],
        "weights": weights,
        "knots_u": _knots(spline.NbUKnots(), spline.UKnot, spline.UMultiplicity),
        "knots_v": _knots(spline.NbVKnots(), spline.VKnot, spline.VMultiplicity),
        "degrees": [spline.UDegree(), spline.VDegree()],
        "is_trimmed": _is_trimmed(face, box),
    }


def _segment(face: Any, box: tuple[float, float, float, float]) -> Any:
    """The part of the face's B-spline within a box. A closed direction is opened where the face goes all around: its box
    then may begin anywhere, and be longer than the period by a rounding error, which no cut survives."""
    from OCP.BRep import BRep_Tool
    from OCP.GeomConvert import GeomConvert

    spline = GeomConvert.SurfaceToBSplineSurface_s(BRep_Tool.Surface_s(face).Copy())
    domain = spline.Bounds()
    ends = []
    for first, is_periodic, unroll in (
        (0, spline.IsUPeriodic(), spline.SetUNotPeriodic),
        (2, spline.IsVPeriodic(), spline.SetVNotPeriodic),
    ):
        (start, end), (lower, upper) = domain[first : first + 2], box[first : first + 2]
        if is_periodic and upper - lower >= (end - start) * (1.0 - WHOLE):
            unroll()
        if not spline.IsUPeriodic() if first == 0 else not spline.IsVPeriodic():
            is_whole = upper - lower >= (end - start) * (1.0 - WHOLE)
            lower, upper = (start, end) if is_whole else (max(lower, start), min(upper, end))
        ends += [lower, upper]
    if any(abs(a - b) > 0.0 for a, b in zip(ends, domain, strict=True)) or spline.IsUPeriodic() or spline.IsVPeriodic():
        spline.Segment(*ends)
    spline.SetUNotPeriodic()
    spline.SetVNotPeriodic()
    return spline


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


def _knots(count: int, value: Any, multiplicity: Any) -> list[float]:
    return [value(i) for i in range(1, count + 1) for _ in range(multiplicity(i))]


def _face_name(reader: Any, face: Any) -> str:
    """Name of the face's entity in the file, or of its surface."""
    entity = reader.WS().TransferReader().EntityFromShapeResult(face, 1)
    for item in (entity, entity.FaceGeometry() if hasattr(entity, "FaceGeometry") else None):
        label: Any = getattr(item, "Name", lambda: None)()
        if label is not None and label.ToCString():
            return str(label.ToCString())
    return ""


def _bound() -> None:
    """Ends with the parent, and before it takes the machine's memory."""
    with suppress(OSError, AttributeError):  # Linux alone
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_AS, (LARGEST_MEMORY, LARGEST_MEMORY))
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main(arguments: list[str]) -> int:
    file, answer = map(Path, arguments)
    _bound()
    try:
        content: dict[str, Any] = {"faces": read_faces(file)}
    except CadError as error:
        content = {"fault": str(error)}
    except MemoryError:
        content = {"fault": f"cannot be read: it takes more than {LARGEST_MEMORY // 1024**3} GB of memory"}
    answer.write_text(json.dumps(content), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
