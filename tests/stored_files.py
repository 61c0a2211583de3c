"""Stored files of a few lines that are as their formats say."""


def count(value):
    return sum(map(count, value)) if isinstance(value, list) else 1


def variable(name, initial, value):
    flat = [number for item in (initial, value) for number in numbers(item)]
    return {
        "name": name,
        "size": count(value),
        "unit": "1",
        "lower": min(flat),
        "upper": max(flat),
        "initial": initial,
        "value": value,
    }


def numbers(value):
    return [number for item in value for number in numbers(item)] if isinstance(value, list) else [value]


def row(name, **changes):
    limits = {"size": 1, "unit": "1", "kind": "inequality", "lower": None, "upper": 1.0}
    return {"name": name, **limits, "initial": 0.5, "value": 0.5, "multiplier": 0.0, "active": False, **changes}


def result(variables, **changes):
    """result.json of a problem of one's own with these design variables."""
    return {
        "schema": "lpc-mdo/result/1",
        "problem": "own",
        "formulation": "paper",
        "settings": {},
        "status": "converged",
        "message": "the certificate holds",
        "objective": {"name": "cost", "unit": "1", "initial": 2.0, "value": 1.0},
        "design_variables": variables,
        "n_design_variables": sum(entry["size"] for entry in variables),
        "variables_on_bounds": [],
        "constraints": [],
        "n_constraints": 0,
        "certificate": {
            "stationarity": 0.0,
            "feasibility": 0.0,
            "complementarity": 0.0,
            "tolerance": {"stationarity": 1e-4, "feasibility": 1e-6},
        },
        "diagnosis": None,
        "counts": {"outer": 1, "inner": 0, "evaluations": 1, "gradients": 1},
        "timing": {"total_s": 1.0, "setup_s": 1.0, "optimize_s": 1.0, "report_s": 1.0},
        "outputs": {},
        "sensitivities": [],
        "provenance": {"version": "0"},
        **changes,
    }


def gross_weight_result(**changes):
    """result.json of the main problem as far as a report compares it."""
    rows = [row("sound_pressure_level"), row("final_state_of_charge")]
    masses = {"pusher_motor": 20.0}
    outputs = {
        "gross_mass_kg": 2800.0,
        "gross_mass_initial_kg": 3300.0,
        "gross_mass_reduction_percent": 15.0,
        "mass_breakdown_kg": masses,
        "mass_breakdown_initial_kg": masses,
        "lift_to_drag_cruise": 13.0,
        "parasitic_drag_coefficient_cruise": 0.04,
        "figure_of_merit_mean": 0.7,
        "sound_pressure_level_dba": 67.0,
        "final_state_of_charge": 0.2,
        "wing_span_m": 12.0,
        "wing_span_initial_m": 15.0,
        "tail_area_m2": 3.0,
        "tail_area_initial_m2": 4.0,
    }
    own = {"problem": "gross-weight", "constraints": rows, "n_constraints": len(rows), "outputs": outputs}
    return result([variable("battery_mass", 800.0, 640.0)], **(own | changes))


def analysis(**changes):
    """analysis.json of a problem of whose designs nothing is stored."""
    return {"schema": "lpc-mdo/analysis/1", "designs": {"initial": {}, "optimized": {}}, "checks": [], **changes}


def point(**changes):
    """A converged point of study.json."""
    return {
        "value": 1.0,
        "folder": "points/00_1",
        "status": "converged",
        "message": "the certificate holds",
        "position": [1.0, 1.0],
        "objective": 1.0,
        "outputs": {},
        "multipliers": {},
        "certificate": result([variable("x", 0.0, 1.0)])["certificate"],
        "counts": {"outer": 1, "inner": 0, "evaluations": 100, "gradients": 1},
        "slope": {"from_multipliers": None, "from_points": None},
        "is_on_front": None,
        "time_s": {"wall": 1.0, "processor": 1.0},
        "start": None,
        **changes,
    }
