"""result.json and history.csv: schema lpc-mdo/result/1, written atomically."""

import csv
import hashlib
import io
import json
import math
import platform
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.files.values import rebuilt
from lpc_mdo.files.write import write_atomically
from lpc_mdo.model.blade_airfoils import vehicle_polars
from lpc_mdo.model.structure_source import structural_surrogate
from lpc_mdo.optimization.result import OptimizationResult, Options
from lpc_mdo.problems.problem import AnalysisT, Problem
from lpc_mdo.reporting.bounds import on_bounds
from lpc_mdo.reporting.diagnosis import diagnose
from lpc_mdo.reporting.flags import regime_flags
from lpc_mdo.reporting.published import is_published_problem
from lpc_mdo.stored.result import SCHEMA, Result

ACTIVE_TOLERANCE = 1e-4  # scaled


def configuration_sha256(vehicle: Vehicle, mission: Mission, settings: Mapping[str, Any] | None = None) -> str:
    """Hash of the validated inputs: the same for the same aircraft, mission and settings however they were given."""
    text = vehicle.model_dump_json() + mission.model_dump_json() + (json.dumps(dict(settings)) if settings else "")
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: Any) -> Any:
    """JSON-ready copy; infinite limits become null."""
    if isinstance(value, Tensor):
        value = value.detach().tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value


def _git_commit() -> str | None:
    folder = Path(__file__).parent
    try:
        run = subprocess.run(["git", "rev-parse", "HEAD"], cwd=folder, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return run.stdout.strip()


def configuration(vehicle: Vehicle, mission: Mission, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The content of configuration.json: the resolved inputs in SI units, and the problem's settings if it has any."""
    content = {"vehicle": vehicle.model_dump(), "mission": mission.model_dump()}
    return content | {"settings": dict(settings)} if settings else content


def provenance(vehicle: Vehicle, mission: Mission, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Versions and hashes of everything that a result depends on."""
    return {
        "version": version("lpc-mdo"),
        "git": _git_commit(),
        "configuration_sha256": configuration_sha256(vehicle, mission, settings),
        "surrogate_sha256": {
            **{polar.name: polar.sha256 for polar in vehicle_polars(vehicle)},
            "structural_mass": structural_surrogate(vehicle).sha256,
        },
        "seed": None,
        **{name: version(name) for name in ("torch", "numpy", "scipy")},
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "threads": torch.get_num_threads(),
    }


def _constraint_rows(
    problem: Problem[AnalysisT], result: OptimizationResult, start: AnalysisT, end: AnalysisT
) -> list[dict[str, Any]]:
    """One entry a row; a row of several components lists them, its norm where it is an equality."""
    parts = [
        t.split(problem.row_sizes) for t in (result.multipliers, problem.constraint_lower, problem.constraint_upper)
    ]
    scaled = result.constraints.split(problem.row_sizes)
    rows = []
    for i, constraint in enumerate(problem.constraints):
        multiplier, lower, upper = (part[i] for part in parts)
        # d f/d limit in engineering units is minus the multiplier of the unscaled row.
        engineering = multiplier * problem.objective.scale / constraint.scale
        gap = torch.minimum((scaled[i] - lower).abs(), (upper - scaled[i]).abs())
        is_single = problem.row_sizes[i] == 1
        initial_row, final_row = problem.rows(start)[i], problem.rows(end)[i]
        entry = {
            "name": constraint.name,
            "size": problem.row_sizes[i],
            "unit": constraint.unit,
            "kind": constraint.kind,
            "lower": constraint.lower,
            "upper": constraint.upper,
            "initial": initial_row[0] if is_single else initial_row,
            "value": final_row[0] if is_single else final_row,
            "multiplier": engineering[0] if is_single else engineering,
            "active": bool((gap <= ACTIVE_TOLERANCE).any()),
        }
        if constraint.kind == "equality" and not is_single:
            entry["norm"] = torch.linalg.vector_norm(final_row)
        rows.append(entry)
    return rows


def build(
    problem: Problem,
    result: OptimizationResult,
    vehicle: Vehicle,
    mission: Mission,
    options: Options,
    timing: Mapping[str, float],
) -> Result:
    """The result as Python users get it and result.json holds it."""
    with torch.no_grad():
        start, end = problem.analyze(problem.x0), problem.analyze(result.x)
    initial, final = problem.physical(problem.x0), problem.physical(result.x)
    rows = _constraint_rows(problem, result, start, end)
    certificate = {
        "stationarity": result.certificate.stationarity,
        "feasibility": result.certificate.feasibility,
        "complementarity": result.certificate.complementarity,
        "tolerance": {"stationarity": options.stationarity_tolerance, "feasibility": options.feasibility_tolerance},
    }
    sensitivities = [
        {
            "of": problem.objective.name,
            "with_respect_to": f"limit of {row['name']}",
            "value": -row["multiplier"],
            "unit": f"{problem.objective.unit}/({row['unit']})",
        }
        for row in rows
        if row["size"] == 1 and row["active"]
    ]
    content = _plain(
        {
            "schema": SCHEMA,
            "vehicle": vehicle.name,
            "is_published_case": is_published_problem(problem, vehicle, mission),
            "problem": problem.name,
            "formulation": problem.formulation,
            "settings": dict(problem.settings),
            "status": result.status,
            "message": result.message,
            "objective": {
                "name": problem.objective.name,
                "unit": problem.objective.unit,
                "initial": problem.objective.of(start),
                "value": problem.objective.of(end),
            },
            "design_variables": [
                {
                    "name": variable.name,
                    "size": variable.count,
                    "unit": variable.unit,
                    "lower": variable.lower,
                    "upper": variable.upper,
                    "initial": initial[variable.name],
                    "value": final[variable.name],
                }
                for variable in problem.variables
            ],
            "n_design_variables": problem.size,
            "variables_on_bounds": [entry.model_dump() for entry in on_bounds(problem, result.x)],
            "constraints": rows,
            "n_constraints": len(problem.constraints),
            "certificate": certificate,
            "diagnosis": None if result.status == "converged" else diagnose(problem, result).model_dump(),
            "counts": asdict(result.counts),
            "timing": dict(timing),
            "outputs": problem.outputs(end, start),
            "flags": [flag.content() for flag in regime_flags(end)],
            "sensitivities": sensitivities,
            "provenance": provenance(vehicle, mission, problem.settings),
        }
    )
    return rebuilt(Result, content)


def write_result(result: Result, folder: Path) -> None:
    write_atomically(folder / "result.json", json.dumps(result.content(), indent=1, allow_nan=False) + "\n")


def write_history(result: OptimizationResult, problem: Problem, folder: Path) -> None:
    write_atomically(folder / "history.csv", history_text(result, problem))


def history_text(result: OptimizationResult, problem: Problem) -> str:
    """One line an iteration: objective in its unit, scaled violation and its row, stationarity, penalty, work, time."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = [
        "phase",
        "iteration",
        f"{problem.objective.name}_{problem.objective.unit}",
        "violation",
        "worst_constraint",
    ]
    more = ["inner_iterations", "largest_step", "damping", "active_rows", "variables_on_bounds"]
    writer.writerow([*names, "stationarity", "penalty", "evaluations", "elapsed_s", *more])
    for record in result.history:
        worst = problem.constraint_label(record.worst_constraint)
        objective = record.objective * problem.objective.scale
        writer.writerow(
            [record.phase, record.iteration, f"{objective:.6f}", f"{record.violation:.3e}", worst]
            + [f"{record.stationarity:.3e}", f"{record.penalty:.3e}", record.evaluations, f"{record.elapsed:.2f}"]
            + [record.inner, f"{record.step:.3e}", f"{record.damping:.1e}", record.active, record.on_bounds]
        )
    return text.getvalue()
