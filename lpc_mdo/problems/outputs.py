"""What a designer reads first of an analysis of the whole aircraft."""

from typing import Any

import torch

from lpc_mdo.config import Vehicle
from lpc_mdo.model.analysis import SEGMENTS, Analysis
from lpc_mdo.model.blade_airfoils import extrapolated_shares
from lpc_mdo.model.structure_source import structural_calibration, structural_surrogate


def gross_weight_outputs(analysis: Analysis, initial: Analysis, vehicle: Vehicle) -> dict[str, Any]:
    """Everything that a designer reads first."""
    names = [rotor.name for rotor in vehicle.rotors]
    propulsion, aerodynamics = analysis.propulsion, analysis.aerodynamics
    structure = structural_surrogate(vehicle)
    inertia = analysis.weights.total.inertia
    lift = [rotor.name for rotor in vehicle.lift_rotors]
    points = [*(f"{name}_hover" for name in lift), "pusher_climb", "pusher_cruise"]
    loads = propulsion.loads
    extrapolated = extrapolated_shares(loads, propulsion.polars)
    # Undefined, and null in files, where the air drives the pusher or it brakes: the flags of the result say so.
    efficiency = torch.where(loads.is_propelling, loads.propulsive_efficiency, torch.nan)[-2:]
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
        "cruise_speed_m_per_s": analysis.flight.speed[2],
        "lift_to_drag_cruise": aerodynamics.lift_to_drag[1],
        "lift_coefficient_cruise": aerodynamics.lift_coefficient[1],
        "drag_coefficient_cruise": aerodynamics.drag_coefficient[1],
        "parasitic_drag_coefficient_cruise": aerodynamics.parasitic_drag_coefficient[1],
        "parasitic_area_cruise_m2": {name: area[1] for name, area in aerodynamics.parasitic_area.items()},
        "maximum_lift_coefficient_cruise": aerodynamics.maximum_lift_coefficient[1],
        "stall_speed_cruise_m_per_s": aerodynamics.stall_speed[1],
        "figure_of_merit": dict(zip(lift, propulsion.figure_of_merit, strict=True)),
        "figure_of_merit_mean": propulsion.figure_of_merit.mean(),
        "propulsive_efficiency": dict(zip(("climb", "cruise"), efficiency, strict=True)),
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
            "calibration_factors": dict(zip(structure.components, structural_calibration(vehicle), strict=True)),
            "outside_training_range": structure.outside(analysis.weights.structural_inputs),
            "leverage": structure.leverage(analysis.weights.structural_inputs),
        },
    }
