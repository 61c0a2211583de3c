"""Run and study folders as they were stored; reading them computes nothing."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lpc_mdo.config.layout import CENTRED
from lpc_mdo.files.read import ConfigurationError, read_json
from lpc_mdo.files.values import shape_of
from lpc_mdo.stored import analysis, configuration, result, starts, study, tables

STUDY_FILE = study.FILE
NO_STRUCTURE = ("battery", "lift_motors", "pusher_motor", "fixed")  # groups of mass that are none
BESIDE = "parametric"  # folder of the front by least speeds, in that of the front by weighted sums


@dataclass(frozen=True)
class StoredRun:
    """Contents of the files of one run folder; starts: what scattered starts said, where the run was the best of them."""

    folder: Path
    result: dict[str, Any]
    analysis: dict[str, Any]
    configuration: dict[str, Any]
    history: list[dict[str, str]]  # one entry an outer iteration
    evaluations: list[dict[str, str]]  # one entry an evaluation of the model
    starts: dict[str, Any] | None = None

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
    """study.json, and the result.json of the points that have one, by their folder's name.

    beside: a study of the same front by other means in a folder of its own, where there is one.
    """

    folder: Path
    content: dict[str, Any]
    results: dict[str, dict[str, Any]]
    beside: "StoredStudy | None" = None


def read_study(folder: Path) -> StoredStudy:
    """The study in `folder`. Raises ConfigurationError as `read_run`."""
    content = study.read_study_file(folder / study.FILE)
    results = {
        point["folder"]: result.read_result(folder / point["folder"] / result.FILE)
        for point in content["points"]
        if point["position"]
    }
    if content["problem"] == "aeroacoustic":
        for point in content["points"]:
            if point["is_on_front"]:
                _require_blades(results[point["folder"]], folder / point["folder"] / result.FILE)
    if content["name"] == "weight-speed":
        for point in content["points"]:
            if point["is_on_front"]:
                _require_parts(results[point["folder"]], folder / point["folder"] / result.FILE)
    is_beside = (folder / BESIDE / study.FILE).exists()
    return StoredStudy(folder, content, results, read_study(folder / BESIDE) if is_beside else None)


def _require_parts(content: dict[str, Any], file: Path) -> None:
    """What more speed costs is told by parts."""
    groups = content["outputs"].get("mass_breakdown_kg")
    is_whole = isinstance(groups, dict) and set(NO_STRUCTURE) <= groups.keys()
    if not is_whole or not all(isinstance(mass, int | float) for mass in groups.values()):
        names = ", ".join(NO_STRUCTURE)
        raise ConfigurationError(f"{file}: outputs.mass_breakdown_kg must hold numbers, {names} among them.")


def _require_blades(content: dict[str, Any], file: Path) -> None:
    """The blades of an end of a front are drawn."""
    design = result.design_of(content)
    for name in ("blade_chord", "blade_twist"):
        if len(shape_of(design.get(name))) != 2:
            raise ConfigurationError(f"{file}: design variable {name} must hold a list of numbers for every rotor.")


def read_run(folder: Path) -> StoredRun:
    """The run in `folder`. Raises ConfigurationError where a file is missing or any of it is not as its format says."""
    if not folder.is_dir():
        raise ConfigurationError(f"{folder} is not allowed; it must be the folder of a run or a study.")
    found = result.read_result(folder / result.FILE)
    designs = analysis.read_analysis(folder / analysis.FILE)
    history = tables.read_history(folder / tables.HISTORY, found["objective"])
    evaluations = tables.read_evaluations(folder / tables.EVALUATIONS, found)
    configuration.read_configuration(folder / configuration.FILE)
    scattered = starts.read_starts(folder / starts.FILE) if (folder / starts.FILE).exists() else None
    return StoredRun(folder, found, designs, read_json(folder / configuration.FILE), history, evaluations, scattered)


def own_rotors(rotors: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of mirrored pairs the rotor to port, and those in the middle."""
    return [rotor for rotor in rotors if rotor["hub_m"][1] <= CENTRED]
