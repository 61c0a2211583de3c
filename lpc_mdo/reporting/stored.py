"""Run and study folders as they were stored; reading them computes nothing."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lpc_mdo.input_files import ConfigurationError, read_csv_rows, read_json

RESULT_SCHEMA = "lpc-mdo/result/1"
ANALYSIS_SCHEMA = "lpc-mdo/analysis/1"
STUDY_SCHEMA = "lpc-mdo/study/1"
STUDY_FILE = "study.json"


@dataclass(frozen=True)
class StoredRun:
    """Contents of the files of one run folder."""

    folder: Path
    result: dict[str, Any]
    analysis: dict[str, Any]
    configuration: dict[str, Any]
    history: list[dict[str, str]]  # one entry an outer iteration
    evaluations: list[dict[str, str]]  # one entry an evaluation of the model

    @property
    def outputs(self) -> dict[str, Any]:
        return self.result["outputs"]

    @property
    def initial(self) -> dict[str, Any]:
        return self.analysis["designs"]["initial"]

    @property
    def optimized(self) -> dict[str, Any]:
        return self.analysis["designs"]["optimized"]


@dataclass(frozen=True)
class StoredStudy:
    """study.json, and the result.json of the points that have one, by their folder's name."""

    folder: Path
    content: dict[str, Any]
    results: dict[str, dict[str, Any]]


def read_study(folder: Path) -> StoredStudy:
    """The study in `folder`. Raises ConfigurationError as `read_run`."""
    content = _with_schema(folder / STUDY_FILE, STUDY_SCHEMA)
    names = [point["folder"] for point in content["points"] if point["position"]]
    return StoredStudy(
        folder, content, {name: _with_schema(folder / name / "result.json", RESULT_SCHEMA) for name in names}
    )


def read_run(folder: Path) -> StoredRun:
    """The run in `folder`. Raises ConfigurationError if a file is missing, is no JSON or has another schema."""
    if not folder.is_dir():
        raise ConfigurationError(f"{folder} is not allowed; it must be the folder of a run or a study.")
    result = _with_schema(folder / "result.json", RESULT_SCHEMA)
    analysis = _with_schema(folder / "analysis.json", ANALYSIS_SCHEMA)
    tables = [_rows(folder / name) for name in ("history.csv", "evaluations.csv")]
    return StoredRun(folder, result, analysis, read_json(folder / "configuration.json"), *tables)


def _rows(file: Path) -> list[dict[str, str]]:
    return read_csv_rows(file)


def _with_schema(file: Path, schema: str) -> dict[str, Any]:
    content = read_json(file)
    found = content.get("schema") if isinstance(content, dict) else None
    if found != schema:
        raise ConfigurationError(f"{file}: schema = {found!r} is not allowed; it must be {schema!r}.")
    return content
