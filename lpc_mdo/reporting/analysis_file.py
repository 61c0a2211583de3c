"""analysis.json: what figures draw, stored when a run ends so that a report computes nothing. Schema lpc-mdo/analysis/1.

docs/report.md lists the fields. Numbers are rounded to seven digits; keys carry units.
"""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.files.write import write_atomically
from lpc_mdo.model.analysis import Analysis, is_whole_aircraft
from lpc_mdo.model.analyzer import Model
from lpc_mdo.model.design import Design, shape_parameters
from lpc_mdo.numerics.present import present
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.acoustics import blades_noise_data, finite_part, hover_noise_data, hover_source, motor_map_data
from lpc_mdo.reporting.data_flow import data_flow
from lpc_mdo.reporting.mold import mold_data
from lpc_mdo.reporting.outlines import outlines
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
    model = problem.analyze_design
    with torch.no_grad():
        start, end = problem.analyze(problem.x0), problem.analyze(result.x)
        designs = {"initial": _design(start, model), "optimized": _optimized_design(end, model)}
    content = {"schema": SCHEMA, "designs": designs, "checks": own_checks(problem, result.x)}
    if is_whole_aircraft(start):
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


def _design(analysis: Any, model: Model) -> dict[str, Any]:
    """What there is: rotors and their points of any analysis of rotors, the rest of one of the whole aircraft."""
    if not isinstance(analysis, Analysis):
        return {}
    found = {
        "summary": _summary(analysis),
        "rotors": _rotors(analysis),
        "operating_points": _operating_points(analysis),
    }
    if not is_whole_aircraft(analysis):
        return found
    return found | {
        "outlines": outlines(model.geometry, analysis.design),
        "mission": _mission(analysis),
        "polar": _polar(analysis, model),
    }


def _optimized_design(analysis: Any, model: Any) -> dict[str, Any]:
    """As `_design`, with what only the optimized aircraft is asked for."""
    found = _design(analysis, model)
    if not found:
        return found
    if not is_whole_aircraft(analysis):
        return found | {"noise": finite_part(blades_noise_data(model, analysis))}
    return found | {
        "mold": mold_data(model.geometry, shape_parameters(analysis.design)),
        "noise": finite_part(hover_noise_data(hover_source(analysis), analysis.mission.requirements)),
        "motor_map": motor_map_data(analysis),
    }


def _summary(analysis: Analysis) -> dict[str, Any]:
    found = {
        "figure_of_merit_mean": analysis.mean_figure_of_merit,
        "sound_pressure_level_dba": analysis.noise.total_dba,
    }
    if not is_whole_aircraft(analysis):
        return found
    return found | {
        "gross_mass_kg": analysis.gross_mass,
        "mass_breakdown_kg": analysis.weights.groups,
        "wing_span_m": analysis.shape.wing.span,
        "wing_area_m2": analysis.shape.wing.area,
        "tail_area_m2": analysis.shape.tail.area,
        "lift_to_drag_cruise": analysis.main_segment.lift_to_drag,
        "final_state_of_charge": present(analysis.energy, "energy").battery.final_state_of_charge,
    }


def _rotors(analysis: Analysis) -> list[dict[str, Any]]:
    """Position, size and blades of each rotor that turns somewhere, in the vehicle file's order."""
    loads, schedule, hubs = analysis.rotors.loads, analysis.schedule, analysis.shape.hubs
    first = {point.rotor: k for k, point in reversed(list(enumerate(schedule.points)))}
    rotors = analysis.vehicle.rotors
    return [
        {
            "name": rotors[i].name,
            "kind": rotors[i].kind,
            "blades": rotors[i].blades,
            "spin": rotors[i].spin,
            "hub_m": hubs[i],
            "radius_m": loads.rotor.radius[k],
            "station_m": loads.station_radius[k],
            "chord_m": loads.rotor.chord[k],
            "twist_rad": loads.rotor.twist[k],
        }
        for i, k in sorted(first.items())
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


def _operating_points(analysis: Analysis) -> list[dict[str, Any]]:
    """Every rotor in every segment where it turns, with the loads along the blade, and its motor where the model has one."""
    schedule, propulsion, loads = analysis.schedule, analysis.propulsion, analysis.rotors.loads
    values = _loads(loads) | {"efficiency": analysis.defined_efficiency()}
    if propulsion is not None:
        drive, operation = analysis.vehicle.motors, propulsion.operation
        values |= {
            "motor_torque_N_m": loads.torque / (drive.gear_ratio * drive.gear_efficiency),
            "motor_speed_rad_per_s": loads.inflow.rotation_speed * drive.gear_ratio,
            "motor_efficiency": operation.efficiency,
            "motor_torque_share": propulsion.torque_share,
            "electrical_power_W": operation.input_power,
        }
    return [
        {
            "rotor": rotor,
            "segment": segment,
            "efficiency_name": "propulsive efficiency" if schedule.is_propelling[k] else "figure of merit",
        }
        | {name: value[k] for name, value in values.items()}
        for k, (rotor, segment) in enumerate(schedule.point_names)
    ]


def _mission(analysis: Analysis) -> list[dict[str, Any]]:
    """The flown sequence: every flight's segments in order, then the reserve.

    A change of altitude that no segment flies is not modelled: the next one begins where the file says.
    """
    mission, energy = analysis.mission, present(analysis.energy, "energy")
    legs = [(f"{name} {flown + 1}", name) for flown in range(mission.flights) for name in mission.flown]
    legs.append(("reserve", mission.main_segment.name))
    charge = torch.cat([torch.ones(1, dtype=torch.float64), energy.battery.state_of_charge])
    found = []
    for k, (name, of) in enumerate(legs):
        segment, i = analysis.segment(of), analysis.schedule.segment_index(of)
        found.append(
            {
                "name": name,
                "segment": of,
                "is_wingborne": mission.segment(of).is_wingborne,
                "duration_s": energy.flown_duration[k],
                "distance_m": analysis.flight.ground_speed[i] * energy.flown_duration[k],
                "altitude_m": (segment.start_altitude, segment.end_altitude),
                "speed_m_per_s": segment.speed,
                "power_W": energy.flown_power[k],
                "state_of_charge": (charge[k], charge[k + 1]),
            }
        )
    return found


def _polar(analysis: Analysis, analyzer: Model) -> dict[str, Any]:
    """Lift and drag in cruise over the angle of attack, tail as trimmed, and the cruise point itself."""
    design, cruise = analysis.design, analysis.main_segment
    i, count = analysis.schedule.wingborne_index(cruise.name), len(POLAR_ANGLES)
    values = {name: value.expand(count, *value.shape) for name, value in design.values().items()}
    # In level flight pitch is the angle of attack; other segments keep their own.
    values["pitch"] = values["pitch"].clone()
    values["pitch"][:, i] = POLAR_ANGLES
    curve = present(analyzer(Design.of(values)).aerodynamics, "aerodynamics")
    return {
        "angle_of_attack_rad": POLAR_ANGLES,
        "lift_coefficient": curve.lift_coefficient[:, i],
        "drag_coefficient": curve.drag_coefficient[:, i],
        "parasitic_drag_coefficient": curve.parasitic_drag_coefficient[:, i],
        "reference_area_m2": present(analysis.aerodynamics, "aerodynamics").reference_area,
        "maximum_lift_coefficient": cruise.maximum_lift_coefficient,
        "cruise": {
            "angle_of_attack_rad": cruise.pitch - cruise.path_angle,
            "lift_coefficient": cruise.lift_coefficient,
            "drag_coefficient": cruise.drag_coefficient,
        },
    }
