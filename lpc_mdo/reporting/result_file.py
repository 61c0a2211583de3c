"""result.json and history.csv: schema lpc-mdo/result/1, written atomically."""

import csv
import hashlib
import io
import json
import math
import platform
import subprocess
import sys
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.analysis import SEGMENTS, Analysis
from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.optimization.result import OptimizationResult, Options
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.files import write_atomically
from surrogates.airfoil import load_airfoil
from surrogates.structural_mass import load_structural_mass

SCHEMA = "lpc-mdo/result/1"
ACTIVE_TOLERANCE = 1e-4  # scaled


def configuration_sha256(vehicle: Vehicle, mission: Mission) -> str:
    """Hash of the validated inputs: the same for the same aircraft and mission however they were given."""
    text = vehicle.model_dump_json() + mission.model_dump_json()
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


def outputs(analysis: Analysis, initial: Analysis, vehicle: Vehicle) -> dict[str, Any]:
    """Everything that a designer reads first."""
    names = [rotor.name for rotor in vehicle.rotors]
    propulsion, aerodynamics = analysis.propulsion, analysis.aerodynamics
    structure = load_structural_mass(vehicle.structure.source)
    inertia = analysis.weights.total.inertia
    points = [*(f"{name}_hover" for name in names[:8]), "pusher_climb", "pusher_cruise"]
    loads = propulsion.loads
    polar = load_airfoil("naca4412")
    extrapolated = polar.extrapolated(loads.angle_of_attack, loads.reynolds, loads.mach).double().mean(-1)
    return {
        "gross_mass_kg": analysis.gross_mass,
        "gross_mass_initial_kg": initial.gross_mass,
        "gross_mass_reduction_percent": 100.0 * (1.0 - analysis.gross_mass / initial.gross_mass),
        "mass_breakdown_kg": analysis.weights.groups,
        "mass_breakdown_initial_kg": initial.weights.groups,
        "center_of_gravity_m": analysis.weights.total.center_of_gravity,
        "inertia_kg_m2": {
            "Ixx": inertia[0, 0],
            "Iyy": inertia[1, 1],
            "Izz": inertia[2, 2],
            "Ixz": -inertia[0, 2],
        },
        "lift_to_drag_cruise": aerodynamics.lift_to_drag[1],
        "lift_coefficient_cruise": aerodynamics.lift_coefficient[1],
        "drag_coefficient_cruise": aerodynamics.drag_coefficient[1],
        "parasitic_drag_coefficient_cruise": aerodynamics.parasitic_drag_coefficient[1],
        "parasitic_area_cruise_m2": {name: area[1] for name, area in aerodynamics.parasitic_area.items()},
        "maximum_lift_coefficient_cruise": aerodynamics.maximum_lift_coefficient[1],
        "stall_speed_cruise_m_per_s": aerodynamics.stall_speed[1],
        "figure_of_merit": dict(zip(names[:8], propulsion.figure_of_merit, strict=True)),
        "figure_of_merit_mean": propulsion.figure_of_merit.mean(),
        "propulsive_efficiency": {
            "climb": propulsion.propulsive_efficiency[0],
            "cruise": propulsion.propulsive_efficiency[1],
        },
        "motor_efficiency": dict(zip(points, propulsion.operation.efficiency, strict=True)),
        "motor_torque_share": dict(zip(points, propulsion.torque_share, strict=True)),
        "motor_mass_kg": dict(zip(names, propulsion.motors.mass, strict=True)),
        "airfoil_extrapolated_share": dict(zip(points, extrapolated, strict=True)),
        "sound_pressure_level_dba": analysis.noise.total_dba,
        "sound_pressure_level_tonal_dba": analysis.noise.tonal_dba,
        "sound_pressure_level_broadband_dba": analysis.noise.broadband_dba,
        "final_state_of_charge": analysis.energy.battery.final_state_of_charge,
        "segment_power_kw": {n: p / 1e3 for n, p in zip(SEGMENTS, analysis.energy.power, strict=True)},
        "segment_duration_s": dict(zip(SEGMENTS, analysis.energy.duration, strict=True)),
        "wing_area_m2": analysis.shape.wing.area,
        "wing_span_m": analysis.shape.wing.span,
        "wing_span_initial_m": initial.shape.wing.span,
        "tail_area_m2": analysis.shape.tail.area,
        "tail_area_initial_m2": initial.shape.tail.area,
        "trim_residual": dict(zip(SEGMENTS, analysis.scaled_trim, strict=True)),
        "trim_residual_axes": ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
        "structural_surrogate": {
            "source": structure.name,
            "outside_training_range": structure.outside(analysis.weights.structural_inputs),
            "leverage": structure.leverage(analysis.weights.structural_inputs),
        },
    }


def _constraint_rows(
    problem: Problem, result: OptimizationResult, start: Analysis, end: Analysis
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
    timing: dict[str, float],
) -> dict[str, Any]:
    """The content of result.json as plain data."""
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
    return _plain(
        {
            "schema": SCHEMA,
            "problem": problem.name,
            "formulation": problem.formulation,
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
            "constraints": rows,
            "n_constraints": len(problem.constraints),
            "certificate": certificate,
            "counts": asdict(result.counts),
            "timing": timing,
            "outputs": outputs(end, start, vehicle),
            "sensitivities": sensitivities,
            "provenance": {
                "version": version("lpc-mdo"),
                "git": _git_commit(),
                "configuration_sha256": configuration_sha256(vehicle, mission),
                "surrogate_sha256": {
                    "naca4412": load_airfoil("naca4412").sha256,
                    "structural_mass": load_structural_mass(vehicle.structure.source).sha256,
                },
                "seed": None,
                **{name: version(name) for name in ("torch", "numpy", "scipy")},
                "python": sys.version.split()[0],
                "platform": platform.platform(),
                "threads": torch.get_num_threads(),
            },
        }
    )


def write_result(content: dict[str, Any], folder: Path) -> None:
    write_atomically(folder / "result.json", json.dumps(content, indent=1, allow_nan=False) + "\n")


def write_history(result: OptimizationResult, problem: Problem, folder: Path) -> None:
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
    writer.writerow([*names, "stationarity", "penalty", "evaluations", "elapsed_s"])
    for record in result.history:
        worst = problem.constraint_label(record.worst_constraint)
        objective = record.objective * problem.objective.scale
        writer.writerow(
            [record.phase, record.iteration, f"{objective:.6f}", f"{record.violation:.3e}", worst]
            + [f"{record.stationarity:.3e}", f"{record.penalty:.3e}", record.evaluations, f"{record.elapsed:.2f}"]
        )
    write_atomically(folder / "history.csv", text.getvalue())
