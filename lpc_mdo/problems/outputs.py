"""What a designer reads first of an analysis of the whole aircraft."""

from typing import Any

from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.blade_airfoils import extrapolated_shares
from lpc_mdo.model.structure_source import structural_calibration, structural_surrogate
from lpc_mdo.numerics.present import present

AXES = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"]


def gross_weight_outputs(analysis: Analysis, initial: Analysis) -> dict[str, Any]:
    """Everything that a designer reads first; of segments on the wing, cruise stands for the one that the reserve is flown as."""
    vehicle, schedule, propulsion = analysis.vehicle, analysis.schedule, present(analysis.propulsion, "propulsion")
    names = [rotor.name for rotor in vehicle.rotors]
    cruise, energy = analysis.main_segment, present(analysis.energy, "energy")
    structure = structural_surrogate(vehicle)
    inertia = analysis.weights.total.inertia
    points = ["_".join(point) for point in schedule.point_names]
    lifting = schedule.in_segment(analysis.mission.noise_segment.name)
    # Undefined, and null in files, where the air drives a pusher or it brakes: the flags of the result say so.
    efficiency = analysis.defined_efficiency()
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
        "cruise_speed_m_per_s": cruise.speed,
        "lift_to_drag_cruise": cruise.lift_to_drag,
        "lift_coefficient_cruise": cruise.lift_coefficient,
        "drag_coefficient_cruise": cruise.drag_coefficient,
        "parasitic_drag_coefficient_cruise": cruise.parasitic_drag_coefficient,
        "parasitic_area_cruise_m2": cruise.parasitic_area,
        "maximum_lift_coefficient_cruise": cruise.maximum_lift_coefficient,
        "stall_speed_cruise_m_per_s": cruise.stall_speed,
        "figure_of_merit": {names[schedule.rotor[k]]: analysis.rotors.efficiency[k] for k in lifting},
        "figure_of_merit_mean": analysis.mean_figure_of_merit,
        "propulsive_efficiency": _of_pushers(analysis, efficiency),
        "motor_efficiency": dict(zip(points, propulsion.operation.efficiency, strict=True)),
        "motor_torque_share": dict(zip(points, propulsion.torque_share, strict=True)),
        "motor_mass_kg": dict(zip(names, propulsion.motors.mass, strict=True)),
        "airfoil_extrapolated_share": dict(
            zip(points, extrapolated_shares(analysis.rotors.loads, analysis.rotors.polars), strict=True)
        ),
        "sound_pressure_level_dba": analysis.noise.total_dba,
        "sound_pressure_level_tonal_dba": analysis.noise.tonal_dba,
        "sound_pressure_level_broadband_dba": analysis.noise.broadband_dba,
        "final_state_of_charge": energy.battery.final_state_of_charge,
        "segment_power_kw": analysis.by_segment(energy.power / 1e3),
        "segment_duration_s": analysis.by_segment(energy.duration),
        "wing_area_m2": analysis.shape.wing.area,
        "wing_span_m": analysis.shape.wing.span,
        "wing_span_initial_m": initial.shape.wing.span,
        "tail_area_m2": analysis.shape.tail.area,
        "tail_area_initial_m2": initial.shape.tail.area,
        "trim_residual": analysis.by_segment(analysis.scaled_trim),
        "trim_residual_axes": AXES,
        "structural_surrogate": {
            "source": structure.name,
            "calibration_factors": dict(zip(structure.components, structural_calibration(vehicle), strict=True)),
            "outside_training_range": structure.outside(analysis.weights.structural_inputs),
            "leverage": structure.leverage(analysis.weights.structural_inputs),
        },
    }


def _of_pushers(analysis: Analysis, efficiency: Any) -> dict[str, Any]:
    """Propulsive efficiency by segment; by rotor and segment where several pushers turn."""
    schedule = analysis.schedule
    points = [k for k, is_propelling in enumerate(schedule.is_propelling) if is_propelling]
    segments = [schedule.point_names[k][1] for k in points]
    is_alone = len(set(segments)) == len(segments)
    return {
        schedule.point_names[k][1] if is_alone else "_".join(schedule.point_names[k]): efficiency[k] for k in points
    }
