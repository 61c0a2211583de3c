"""study.json, schema lpc-mdo/study/1, and the point.json of each of its points."""

from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from lpc_mdo.files.read import ConfigurationError, read_json
from lpc_mdo.files.values import Name, NotNegative, Number, Stored, Text, invalid, read_table, validated
from lpc_mdo.stored.outputs import require_levels
from lpc_mdo.stored.provenance import Provenance
from lpc_mdo.stored.result import Certificate, Counts, StoredFlag

SCHEMA = "lpc-mdo/study/1"
FILE = "study.json"
POINT_FILE = "point.json"


def _inside(folder: str) -> str:
    path = PurePosixPath(folder)
    if path.is_absolute() or ".." in path.parts or not path.parts:
        raise invalid(folder, "name a folder within the study's")
    return folder


class Parameter(Stored):
    name: Name
    unit: Name
    key: Name | None


class Axis(Stored):
    name: Name
    unit: Name
    goal: Literal["minimize", "maximize"] | None


class Slope(Stored):
    from_multipliers: Number | None
    from_points: Number | None


class Spent(Stored):
    wall: NotNegative
    processor: NotNegative


class Point(Stored):
    """Null where the point has no result yet, or none at all."""

    value: Number
    folder: Annotated[Name, AfterValidator(_inside)]
    status: Name
    message: Text
    position: tuple[Number, Number] | None
    objective: Number | None
    outputs: dict[Name, Number | bool] | None
    multipliers: dict[Name, Any] | None
    certificate: Certificate | None
    counts: Counts | None
    flags: list[StoredFlag] = Field(default_factory=list)  # points of earlier versions have none
    slope: Slope
    is_on_front: bool | None
    time_s: Spent | None
    start: Name | None

    @model_validator(mode="after")
    def _has_what_its_status_says(self) -> "Point":
        try:
            require_levels(self.outputs or {})
        except ValueError as error:
            raise ValueError(f"outputs.{error}") from None
        if self.status in ("pending", "failed"):
            return self
        for key in ("position", "objective", "outputs", "multipliers", "certificate", "counts"):
            if getattr(self, key) is None:
                raise ValueError(f"{key} is missing from a point of status {self.status!r}")
        return self


class StoredPoint(Point):
    study_sha256: Name


class Timing(Stored):
    wall_s: NotNegative
    processor_s: NotNegative


class Study(Stored):
    kind: Literal["pareto", "sweep", "starts"]
    vehicle: Name | None = None  # studies of earlier versions name none
    is_published_case: bool = Field(False, strict=True)
    name: Name
    problem: Name
    formulation: Name
    method: Name
    parameter: Parameter
    axes: list[Axis] = Field(min_length=2, max_length=2)
    points: list[Point] = Field(min_length=1)
    timing: Timing
    provenance: Provenance

    @model_validator(mode="after")
    def _is_of_one_piece(self) -> "Study":
        folders = [point.folder for point in self.points]
        if len(set(folders)) < len(folders):
            raise ValueError("points: two have the same folder; every one must have its own")
        for i, point in enumerate(self.points):
            if point.is_on_front and point.status != "converged":
                raise ValueError(f"points[{i}].is_on_front = True is invalid: the point must have converged")
            if point.is_on_front is None and self.kind == "pareto":
                raise ValueError(f"points[{i}].is_on_front = None is invalid: it must be true or false")
            if point.is_on_front and point.position is not None:
                self._require_comparable(i, point)
        return self

    def _require_comparable(self, i: int, point: Point) -> None:
        """What the published study's front is compared with."""
        if self.name == "noise-efficiency" and "sound_pressure_level_unweighted_db" not in (point.outputs or {}):
            raise ValueError(f"points[{i}].outputs.sound_pressure_level_unweighted_db is missing")
        if self.name == "weight-speed" and not min(point.position or (0.0,)) > 0.0:
            raise ValueError(f"points[{i}].position = {point.position} is invalid: both must be positive")


def read_study_file(file: Path) -> dict[str, Any]:
    """Content of a study.json. Raises ConfigurationError where any of it is not as the format says."""
    content = read_table(file, SCHEMA)
    validated(Study, content, file)
    return content


def read_point(file: Path, advice: str = "") -> dict[str, Any]:
    """The keys of a point.json that its format has. Raises ConfigurationError as `read_study_file`, `advice` added."""
    content = read_json(file)
    if not isinstance(content, dict):
        raise ConfigurationError(f"{file}: it must be a table of keys{advice}.")
    validated(StoredPoint, content, file, advice=advice)
    return {key: content.get(key, []) for key in StoredPoint.model_fields}
