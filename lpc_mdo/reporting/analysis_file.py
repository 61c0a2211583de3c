"""analysis.json: what figures draw, stored when a run ends so that a report computes nothing. Schema lpc-mdo/analysis/1.

docs/report.md lists the fields. Numbers are rounded to seven digits; keys carry units.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.analysis import Analysis, Analyzer
from lpc_mdo.config import RotorSpecification
from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.files.write import write_atomically
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.problems.aeroacoustic import HoverAnalyzer
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.acoustics import blades_noise_data, hover_noise_data, hover_source, motor_map_data
from lpc_mdo.reporting.data_flow import data_flow
from lpc_mdo.reporting.mold import mold_data
from lpc_mdo.reporting.outlines import outlines, shape_parameters
from lpc_mdo.reporting.own_checks import own_checks
from lpc_mdo.reporting.sensitivities import sensitivities
from lpc_mdo.reporting.surrogate_samples import shipped_sample_data

SCHEMA = "lpc-mdo/analysis/1"
FILE = "analysis.json"
DIGITS = 7
POLAR_ANGLES = torch.deg2rad(torch.linspace(-6.0, 12.0, 10, dtype=torch.float64))


def build(problem: Problem[Any], result: OptimizationResult) -> dict[str, Any]:
    """Content of analysis.json for the initial design and that of `result`.

    Sensitivities are those of a converged result; they and the data flow are of the whole aircraft's analysis only. Of
    designs that are neither an aircraft nor its lift rotors nothing is stored.
    """
    before, after = _DESIGNS.get(type(problem.analyze_design), (_other_design, _other_design))
    with torch.no_grad():
        designs = {"initial": before(problem, problem.x0), "optimized": after(problem, result.x)}
    content = {"schema": SCHEMA, "designs": designs, "checks": own_checks(problem, result.x)}
    if isinstance(problem.analyze_design, Analyzer):
        flow = data_flow(problem)
        passes = [{"from": giver, "to": taker, "count": count} for giver, taker, count in flow.passes]
        answers = sensitivities(problem, result) if result.status == "converged" else []
        content["surrogate_samples"] = shipped_sample_data()
        content["data_flow"] = {"blocks": flow.blocks, "passes": passes}
        content["sensitivities"] = [asdict(answer) for answer in answers]
    return content


def text(content: dict[str, Any]) -> str:
    """analysis.json as it is stored."""
    return json.dumps(_rounded(content), allow_nan=False) + "\n"


def write(content: dict[str, Any], folder: Path) -> None:
    write_atomically(folder / FILE, text(content))


def _rounded(value: Any) -> Any:
    """JSON-ready copy: tensors and arrays become lists, numbers keep DIGITS significant digits; not finite is null."""
    if isinstance(value, Tensor | np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    return value


def _design(problem: Problem[Analysis], x: Tensor) -> dict[str, Any]:
    analyzer: Analyzer = problem.analyze_design
    analysis = problem.analyze(x)
    return {
        "summary": _summary(analysis),
        "outlines": outlines(analyzer.geometry, analysis.design),
        "rotors": _rotors(analysis.propulsion.loads, analysis.shape.hubs, analyzer.vehicle.rotors),
        "operating_points": _operating_points(analysis, analyzer),
        "mission": _mission(analysis, analyzer),
        "polar": _polar(analysis, analyzer),
    }


def _optimized_design(problem: Problem[Analysis], x: Tensor) -> dict[str, Any]:
    """As `_design`, with what only the optimized aircraft is asked for."""
    analysis, vehicle = problem.analyze(x), problem.analyze_design.vehicle
    geometry = problem.analyze_design.geometry
    return _design(problem, x) | {
        "mold": mold_data(geometry, shape_parameters(analysis.design)),
        "noise": hover_noise_data(hover_source(analysis), problem.analyze_design.mission.requirements),
        "motor_map": motor_map_data(analysis, vehicle.motors.gear_ratio),
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


def _hover_design(problem: Problem[Any], x: Tensor) -> dict[str, Any]:
    """Blades and their operation of a problem over the lift rotors alone, whose analysis has `loads` and `noise`."""
    analysis, analyzer = problem.analyze(x), problem.analyze_design
    loads, lift = analysis.loads, analyzer.vehicle.lift_rotors
    points = [
        {"rotor": rotor.name, "segment": "hover", "efficiency_name": "figure of merit", "efficiency": merit}
        | {name: value[i] for name, value in _loads(loads).items()}
        for i, (rotor, merit) in enumerate(zip(lift, loads.figure_of_merit, strict=True))
    ]
    return {
        "summary": {
            "figure_of_merit_mean": loads.figure_of_merit.mean(),
            "sound_pressure_level_dba": analysis.noise.total_dba,
        },
        "rotors": _rotors(loads, analyzer.hubs, lift),
        "operating_points": points,
    }


def _optimized_hover_design(problem: Problem[Any], x: Tensor) -> dict[str, Any]:
    return _hover_design(problem, x) | {"noise": blades_noise_data(problem.analyze_design, problem.analyze(x))}


def _rotors(loads: RotorLoads, hubs: Tensor, rotors: Sequence[RotorSpecification]) -> list[dict[str, Any]]:
    """Position, size and blades of each rotor."""
    return [
        {
            "name": rotor.name,
            "kind": rotor.kind,
            "blades": rotor.blades,
            "spin": rotor.spin,
            "hub_m": hubs[i],
            "radius_m": loads.rotor.radius[i],
            "station_m": loads.station_radius[i],
            "chord_m": loads.rotor.chord[i],
            "twist_rad": loads.rotor.twist[i],
        }
        for i, rotor in enumerate(rotors)
    ]


def _loads(loads: RotorLoads) -> dict[str, Tensor]:
    """What a rotor does, (point,) and (point, station)."""
    speed = loads.inflow.rotation_speed
    return {
        "thrust_N": loads.thrust,
        "torque_N_m": loads.torque,
        "speed_rad_per_s": speed,
        "tip_mach": speed * loads.rotor.radius / loads.inflow.speed_of_sound,
        "axial_velocity_m_per_s": loads.inflow.axial_velocity,
        "angle_of_attack_rad": loads.angle_of_attack,
        "lift_coefficient": loads.lift_coefficient,
        "thrust_per_length_N_per_m": loads.thrust_per_length,
    }


def _operating_points(analysis: Analysis, analyzer: Analyzer) -> list[dict[str, Any]]:
    """Rotor and motor in hover (lift rotors), in climb and in cruise (pusher), with the loads along the blade."""
    propulsion, rotors = analysis.propulsion, analyzer.vehicle.rotors
    loads, operation = propulsion.loads, propulsion.operation
    lift = len(analyzer.vehicle.lift_rotors)
    segments = ["hover"] * lift + ["climb", "cruise"]
    merits = torch.cat([loads.figure_of_merit[:lift], loads.propulsive_efficiency[lift:]])
    merits = torch.where(loads.is_propelling, merits, torch.nan)
    gear = analyzer.vehicle.motors
    values = _loads(loads) | {
        "motor_torque_N_m": loads.torque / (gear.gear_ratio * gear.gear_efficiency),
        "motor_speed_rad_per_s": loads.inflow.rotation_speed * gear.gear_ratio,
        "motor_efficiency": operation.efficiency,
        "motor_torque_share": propulsion.torque_share,
        "electrical_power_W": operation.input_power,
    }
    return [
        {
            "rotor": rotors[index].name,
            "segment": segments[i],
            "efficiency_name": "figure of merit" if segments[i] == "hover" else "propulsive efficiency",
            "efficiency": merits[i],
        }
        | {name: value[i] for name, value in values.items()}
        for i, index in enumerate(analyzer.point_rotor.tolist())
    ]


def _mission(analysis: Analysis, analyzer: Analyzer) -> list[dict[str, Any]]:
    """The flown sequence: every flight's hover, climb and cruise, then the reserve at cruise power.

    Descent is not modelled: each flight begins at hover altitude, and its range is that of climb and cruise.
    """
    mission, energy, flight = analyzer.mission, analysis.energy, analysis.flight
    hover, top, cruise = mission.hover.altitude, analysis.design.climb_end_altitude, analysis.design.cruise_altitude
    ground_speed = flight.speed * torch.cos(flight.path_angle)
    names = ["hover", "climb", "cruise"]
    altitudes = [(hover, hover), (hover, top), (cruise, cruise)]
    plan = [
        (f"{name} {flown + 1}", i, energy.duration[i])
        for flown in range(mission.flights)
        for i, name in enumerate(names)
    ]
    plan.append(("reserve", 2, energy.reserve_duration))
    charge = torch.cat([torch.ones(1, dtype=torch.float64), energy.battery.state_of_charge])
    return [
        {
            "name": name,
            "segment": names[i],
            "duration_s": duration,
            "distance_m": ground_speed[i] * duration,
            "altitude_m": altitudes[i],
            "speed_m_per_s": flight.speed[i],
            "power_W": energy.power[i],
            "state_of_charge": (charge[k], charge[k + 1]),
        }
        for k, (name, i, duration) in enumerate(plan)
    ]


def _polar(analysis: Analysis, analyzer: Analyzer) -> dict[str, Any]:
    """Lift and drag in cruise over the angle of attack, tail as trimmed, and the cruise point itself."""
    design, aero = analysis.design, analysis.aerodynamics
    count = len(POLAR_ANGLES)
    swept = replace(
        design,
        **{name: value.expand(count, *value.shape) for name, value in vars(design).items() if name != "pitch"},
        # In level flight pitch is the angle of attack; climb keeps its own.
        pitch=torch.stack([design.pitch[0].expand(count), POLAR_ANGLES], dim=-1),
    )
    curve = analyzer(swept).aerodynamics
    return {
        "angle_of_attack_rad": POLAR_ANGLES,
        "lift_coefficient": curve.lift_coefficient[:, 1],
        "drag_coefficient": curve.drag_coefficient[:, 1],
        "parasitic_drag_coefficient": curve.parasitic_drag_coefficient[:, 1],
        "reference_area_m2": aero.reference_area,
        "maximum_lift_coefficient": aero.maximum_lift_coefficient[1],
        "cruise": {
            "angle_of_attack_rad": analysis.flight.angle_of_attack[2],
            "lift_coefficient": aero.lift_coefficient[1],
            "drag_coefficient": aero.drag_coefficient[1],
        },
    }


def _other_design(problem: Problem[Any], x: Tensor) -> dict[str, Any]:
    return {}


_DESIGNS = {Analyzer: (_design, _optimized_design), HoverAnalyzer: (_hover_design, _optimized_hover_design)}
