"""analysis.json: what figures draw, stored when a run ends so that a report computes nothing. Schema lpc-mdo/analysis/1.

docs/report.md lists the fields. Numbers are rounded to seven digits; lengths are in m, angles in rad, forces in N.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.analysis import Analysis, Analyzer
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.outlines import outlines
from lpc_mdo.reporting.result_file import write_atomically

SCHEMA = "lpc-mdo/analysis/1"
DIGITS = 7
POLAR_ANGLES = torch.deg2rad(torch.linspace(-6.0, 12.0, 10, dtype=torch.float64))


def build(problem: Problem[Analysis], x: Tensor) -> dict[str, Any]:
    """Content of analysis.json for the initial design and the design of scaled x (n,)."""
    return {
        "schema": SCHEMA,
        "designs": {name: _design(problem, at) for name, at in (("initial", problem.x0), ("optimized", x))},
    }


def write(content: dict[str, Any], folder: Path) -> None:
    write_atomically(folder / "analysis.json", json.dumps(_rounded(content), allow_nan=False) + "\n")


def _rounded(value: Any) -> Any:
    """JSON-ready copy: tensors and arrays become lists, numbers keep DIGITS significant digits."""
    if isinstance(value, Tensor | np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return value


def _design(problem: Problem[Analysis], x: Tensor) -> dict[str, Any]:
    analyzer: Analyzer = problem.analyze_design
    with torch.no_grad():
        analysis = problem.analyze(x)
        return {
            "summary": _summary(analysis),
            "outlines": outlines(analyzer.geometry, analysis.design),
            "rotors": _rotors(analysis, analyzer),
        }


def _summary(analysis: Analysis) -> dict[str, Any]:
    return {
        "gross_mass_kg": analysis.gross_mass,
        "mass_breakdown_kg": analysis.weights.groups,
        "wing_span_m": analysis.shape.wing.span,
        "wing_area_m2": analysis.shape.wing.area,
        "tail_area_m2": analysis.shape.tail.area,
        "lift_to_drag_cruise": analysis.aerodynamics.lift_to_drag[1],
        "figure_of_merit_mean": analysis.propulsion.figure_of_merit.mean(),
        "sound_pressure_level_dba": analysis.noise.total_dba,
        "final_state_of_charge": analysis.energy.battery.final_state_of_charge,
    }


def _rotors(analysis: Analysis, analyzer: Analyzer) -> list[dict[str, Any]]:
    """Position, size and blades of each rotor."""
    blades = analysis.propulsion.loads.rotor
    return [
        {
            "name": rotor.name,
            "kind": rotor.kind,
            "blades": rotor.blades,
            "spin": rotor.spin,
            "hub_m": analysis.shape.hubs[i],
            "radius_m": blades.radius[i],
            "station_m": analysis.propulsion.loads.station_radius[i],
            "chord_m": blades.chord[i],
            "twist_rad": blades.twist[i],
        }
        for i, rotor in enumerate(analyzer.vehicle.rotors)
    ]
