"""study.json: schema lpc-mdo/study/1, put together from the points' own files (docs/study-files.md)."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from math import degrees
from pathlib import Path
from typing import Any

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import write_atomically
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.published import is_published_case
from lpc_mdo.reporting.result_file import provenance
from lpc_mdo.stored.designs import multipliers_by_row, scaled_design
from lpc_mdo.stored.result import FILE as RESULT_FILE
from lpc_mdo.stored.result import read_result
from lpc_mdo.stored.study import FILE as STUDY_FILE
from lpc_mdo.stored.study import POINT_FILE, SCHEMA, read_point, read_study_file
from lpc_mdo.studies.pareto import non_dominated
from lpc_mdo.studies.study import Study

RESOLUTION = 1e-7  # relative: optima that differ by less are one to the solver
COPIED = ("status", "message", "position", "objective", "outputs", "multipliers", "certificate", "counts", "flags")
FOREIGN = "belongs to a study of other values or files; name another --output or leave --resume out."
RESTART = "; remove that point's folder, and --resume runs it again"


def identity(study: Study, solver: str) -> str:
    """Hash of everything that the points depend on: a study may only be resumed with the same."""
    parts = [study.kind, study.name, study.method, asdict(study.parameter), study.values, repr(study.problems), solver]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def folder_names(study: Study) -> tuple[str, ...]:
    """Run folders of the points, relative to the study's."""
    return tuple(f"points/{i:02d}_{value:.6g}" for i, value in enumerate(study.values))


def json_text(content: Any) -> str:
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def write_json(file: Path, content: Any) -> None:
    write_atomically(file, json_text(content))


def read_points(study: Study, folder: Path, key: str) -> list[dict[str, Any] | None]:
    """The stored entry of every point; None where there is none yet, or where the last attempt failed.

    Raises ConfigurationError for a study or a point of other values or files, and for one that is damaged.
    """
    _require_same(study, folder / STUDY_FILE)
    entries: list[dict[str, Any] | None] = []
    problem = None
    for name in folder_names(study):
        file = folder / name / POINT_FILE
        entry = read_point(file, RESTART) if file.exists() else None
        if entry is not None and entry.pop("study_sha256") != key:
            raise ConfigurationError(f"{file}: {FOREIGN}")
        if entry is not None and entry["status"] == "failed":
            entry = None
        if entry is not None:
            problem = problem or study.problems(study.values[:1])[0]
            _require_point(study, len(entries), entry, file, problem)
        entries.append(entry)
    return entries


def _require_same(study: Study, file: Path) -> None:
    """Raises ConfigurationError if the study file is there and of other values: their points have folders of other names."""
    if not file.exists():
        return
    stored = read_study_file(file)
    theirs = (*(stored[key] for key in ("kind", "name", "method")), [point["value"] for point in stored["points"]])
    if theirs != (study.kind, study.name, study.method, list(study.values)):
        raise ConfigurationError(f"{file}: {FOREIGN}")


def _require_point(study: Study, index: int, entry: dict[str, Any], file: Path, problem: Problem) -> None:
    """Raises ConfigurationError unless the entry, and the result beside it, are those of the study's point."""
    own = {"value": study.values[index], "folder": folder_names(study)[index]}
    for name, value in own.items():
        if entry[name] != value:
            raise ConfigurationError(f"{file}: {name} = {entry[name]!r} is invalid: it must be {value!r}{RESTART}.")
    result = read_result(file.parent / RESULT_FILE)
    scaled_design(result, file.parent / RESULT_FILE, problem)
    multipliers_by_row(result, file.parent / RESULT_FILE, problem)
    copied = entry_of(study, index, result, None)
    for name in COPIED:
        if entry[name] != copied[name]:
            raise ConfigurationError(
                f"{file}: {name} is not that of the {RESULT_FILE} beside it; both must be of one run{RESTART}."
            )


def entry_of(study: Study, index: int, content: dict[str, Any], slope: float | None) -> dict[str, Any]:
    """A point of study.json from its result.json and the slope by the envelope theorem."""
    outputs = {name: value for name, value in content["outputs"].items() if isinstance(value, int | float)}
    value = study.values[index]
    return {
        "value": value,
        "folder": folder_names(study)[index],
        "status": content["status"],
        "message": content["message"],
        "position": [value if axis.name == study.parameter.name else outputs[axis.name] for axis in study.axes],
        "objective": content["objective"]["value"],
        "outputs": outputs,
        "multipliers": {row["name"]: row["multiplier"] for row in content["constraints"]},
        "certificate": content["certificate"],
        "counts": content["counts"],
        "flags": content.get("flags", []),
        "slope": {"from_multipliers": slope, "from_points": None},
        "is_on_front": None,
    }


def empty_entry(study: Study, index: int, status: str, message: str) -> dict[str, Any]:
    """A point that is not run yet ("pending") or has no result ("failed")."""
    keys = ("position", "objective", "outputs", "multipliers", "certificate", "counts", "time_s", "start")
    return {
        "value": study.values[index],
        "folder": folder_names(study)[index],
        "status": status,
        "message": message,
        **dict.fromkeys(keys),
        "flags": [],
        "slope": {"from_multipliers": None, "from_points": None},
        "is_on_front": False if study.kind == "pareto" else None,
    }


def parabola_slope(at: int, points: Sequence[Sequence[float]]) -> float | None:
    """Derivative at points[at] of the parabola through it and the two next to it (x, y); None with coinciding x."""
    first = min(max(at - 1, 0), len(points) - 3)
    if len(points) < 3:
        return None
    (x0, y0), (x1, y1), (x2, y2) = points[first : first + 3]
    if len({x0, x1, x2}) < 3:
        return None
    left, right = (y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1)
    return left + (right - left) / (x2 - x0) * (2.0 * points[at][0] - x0 - x1)


def _settings(study: Study) -> dict[str, float]:
    """Where the observer of a front in hover is."""
    observer = getattr(study.problems, "observer", None)
    if observer is None:
        return {}
    return {"observer_distance_m": observer.distance, "observer_elevation_deg": degrees(observer.elevation)}


def assemble(study: Study, entries: Sequence[dict[str, Any] | None], timing: dict[str, float]) -> dict[str, Any]:
    """The whole of study.json: front and slopes from points follow from the entries of all points."""
    points = [
        dict(entry) if entry else empty_entry(study, i, "pending", "not run yet") for i, entry in enumerate(entries)
    ]
    certified = [i for i, point in enumerate(points) if point["status"] == "converged"]
    if study.kind == "pareto":
        goals = [present(axis.goal, f"the goal of {axis.name}") for axis in study.axes]
        on_front = non_dominated([points[i]["position"] for i in certified], goals, RESOLUTION)
        for point in points:
            point["is_on_front"] = False
        for i, is_on_front in zip(certified, on_front, strict=True):
            points[i]["is_on_front"] = is_on_front
        certified = [i for i in certified if points[i]["is_on_front"]]
    if study.kind == "starts":  # not points of one curve
        certified = []
    row = [points[i]["position"] for i in certified]
    for at, i in enumerate(certified):
        points[i]["slope"] = {**points[i]["slope"], "from_points": parabola_slope(at, row)}
    return {
        "schema": SCHEMA,
        "vehicle": study.inputs[0].name,
        "is_published_case": is_published_case(*study.inputs, _settings(study)),
        "kind": study.kind,
        "name": study.name,
        "problem": study.problem,
        "formulation": study.formulation,
        "method": study.method,
        "parameter": asdict(study.parameter),
        "axes": [asdict(axis) for axis in study.axes],
        "points": points,
        "timing": timing,
        "provenance": provenance(*study.inputs, {}),
    }
