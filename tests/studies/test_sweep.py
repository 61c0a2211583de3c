"""Sweeps: which parameters there are, and the slope of the optimum by the envelope theorem."""

import itertools
import math

import pytest
import torch
from analytic_studies import distances

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.sweep import ByKey, ByLimit, Envelope, by_key, sweep, with_limit


def test_a_sweep_is_monotone_certified_and_has_the_slope_of_its_closed_form(tmp_path):
    """Squared distance from (1, 0) to a wall at p: (1 - p)^2 with slope -2 (1 - p), zero behind the point."""
    values = [0.2, 0.4, 0.6, 0.8, 1.2]
    content = StudyRun(distances(values), tmp_path, InProcess(), "slsqp").run()
    row = [point["position"] for point in content["points"]]
    assert [x for x, _ in row] == values
    assert all(later <= earlier + 1e-9 for (_, earlier), (_, later) in itertools.pairwise(row))
    for point in content["points"]:
        gap = max(0.0, 1.0 - point["value"])
        assert point["status"] == "converged"
        assert point["is_on_front"] is None
        assert point["certificate"]["feasibility"] <= 1e-6
        assert point["position"][1] == pytest.approx(gap**2, abs=1e-6)
        assert point["slope"]["from_multipliers"] == pytest.approx(-2.0 * gap, abs=1e-4)
        assert point["multipliers"]["wall"] == pytest.approx(2.0 * gap, abs=1e-4)
    for point in content["points"][1:3]:  # a parabola's slope from its points is exact
        assert point["slope"]["from_points"] == pytest.approx(point["slope"]["from_multipliers"], abs=1e-4)


def test_the_partial_derivative_of_a_file_scalar_is_that_of_the_model():
    """Gross mass is affine in the factor on the structural masses, with their sum over the factor as its slope."""
    fixed = ("vehicle.motors.lift_bounds=file",)  # else the motors' bounds follow the mass
    vehicle, mission = load(overrides=fixed)
    problem = gross_weight_problem(vehicle, mission)
    with torch.no_grad():
        groups = problem.analyze(problem.x0).weights.groups
    other = ("lift_motors", "pusher_motor", "battery", "fixed")
    structure = sum(float(mass) for name, mass in groups.items() if name not in other)
    factor = vehicle.structure.calibration_factor
    slope = Envelope(by_key(None, None, fixed, "vehicle.structure.calibration_factor", [factor, 2.0]))
    none = torch.zeros(sum(problem.row_sizes), dtype=torch.float64)
    assert slope(factor, problem, problem.x0, none) == pytest.approx(structure / factor, rel=1e-8)


def test_bounds_that_move_with_the_parameter_are_part_of_its_slope():
    """A heavier airframe asks for larger lift motors: at scaled x they grow with their lower bounds."""
    key, problem = "vehicle.structure.calibration_factor", gross_weight_problem(*load())
    factor = load()[0].structure.calibration_factor
    slope = Envelope(by_key(None, None, (), key, [factor, 2.0]))
    none = torch.zeros(sum(problem.row_sizes), dtype=torch.float64)
    with torch.no_grad():
        light, heavy = (
            gross_weight_problem(*load(overrides=[f"{key}={factor + change!r}"])).analyze(problem.x0)
            for change in (-1e-3, 1e-3)
        )
    assert float(heavy.weights.groups["lift_motors"]) > float(light.weights.groups["lift_motors"])
    change = float(heavy.gross_mass - light.gross_mass) / 2e-3
    assert slope(factor, problem, problem.x0, none) == pytest.approx(change, rel=1e-6)


def test_the_slope_at_a_limit_is_minus_its_multiplier_in_engineering_units():
    problems = ByLimit(*load(), "sound_pressure_level")
    problem = problems([67.0])[0]
    first = sum(problem.row_sizes[: [c.name for c in problem.constraints].index("sound_pressure_level")])
    multipliers = torch.zeros(sum(problem.row_sizes), dtype=torch.float64)
    multipliers[first] = 0.3
    scale = problem.objective.scale / problem.constraints[4].scale
    assert Envelope(problems)(67.0, problem, problem.x0, multipliers) == pytest.approx(-0.3 * scale, rel=1e-6)


def test_at_the_end_of_a_range_the_difference_is_one_sided():
    table = by_key(None, None, (), "mission.flights", [1, 2])
    assert isinstance(table, ByKey)
    ends = by_key(None, None, (), "mission.requirements.minimum_final_state_of_charge", [0.5, 0.9])
    below, above = ends.near(0.9)
    assert below == pytest.approx(0.9 * (1.0 - 1e-4))
    assert above == 0.9


@pytest.mark.parametrize(
    ("name", "key", "unit"),
    [
        ("battery-energy-density", "vehicle.battery.specific_energy_Wh_per_kg", "Wh/kg"),
        ("final-state-of-charge", "final_state_of_charge", "1"),
        ("vehicle.wing.area_m2", "vehicle.wing.area_m2", "m^2"),
        ("mission.cruise.speed_m_per_s", "mission.cruise.speed_m_per_s", "m/s"),
        ("sound_pressure_level", "sound_pressure_level", "dB(A)"),
        ("vehicle.drag.leakage_and_protuberance", "vehicle.drag.leakage_and_protuberance", "1"),
    ],
)
def test_any_scalar_and_any_limit_can_be_swept(name, key, unit):
    values = () if "-" in name else {"m^2": (19, 20), "m/s": (60, 58), "dB(A)": (66, 67)}.get(unit, (0.1, 0.2))
    study = sweep(name, values=values)
    assert (study.parameter.key, study.parameter.unit) == (key, unit)
    assert list(study.values) == sorted(study.values)
    assert study.axes[1].goal == "minimize"


def test_another_limit_leaves_the_other_rows_alone():
    problem = gross_weight_problem(*load())
    changed = with_limit(problem, "final_state_of_charge", 0.33)
    assert changed.analyze_design is problem.analyze_design
    for old, new in zip(problem.constraints, changed.constraints, strict=True):
        if old.name == "final_state_of_charge":
            assert (new.lower, new.upper) == (0.33, math.inf)
        else:
            assert new is old


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("no_such_row", (1.0, 2.0)), "'no_such_row' is not allowed; it must be one of final_state_of_charge"),
        (("trim_residual", (1.0, 2.0)), "'trim_residual' is not allowed"),
        (("vehicle.wing.area_m2", (-1.0, 20.0)), "vehicle.wing.area_m2=-1.0: wing.area_m2 = -1.0 is not allowed"),
        (("vehicle.wing.span_m", (1.0, 2.0)), "'span_m' is not a known key"),
        (("vehicle.wing.taper", ()), "--values is missing"),
        (("vehicle.wing.taper", (0.3,)), "--values 0.3 is not allowed; it must be two or more"),
        (("vehicle.wing.taper", (0.3, 0.3)), "--values 0.3,0.3 is not allowed"),
        (("vehicle.wing.taper", (0.3, math.nan)), "different finite numbers"),
    ],
)
def test_sweeps_that_cannot_be_are_refused(arguments, message):
    name, values = arguments
    with pytest.raises(ConfigurationError, match=message):
        sweep(name, values=values)
