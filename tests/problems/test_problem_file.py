"""Problems written in files: names of variables, rows and numbers of the analysis, and what is refused."""

import pytest
import torch

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem_file import problem_of, quantity


@pytest.fixture(scope="module")
def start():
    problem = gross_weight_problem(*load())
    with torch.no_grad():
        return problem.analyze(problem.x0)


def of(tmp_path, text):
    file = tmp_path / "problem.toml"
    file.write_text(text)
    return problem_of(file, *load())


def test_an_empty_file_is_the_published_problem(tmp_path):
    ours, published = of(tmp_path, ""), gross_weight_problem(*load())
    assert torch.equal(ours.x0, published.x0)
    assert [row.name for row in ours.constraints] == [row.name for row in published.constraints]
    with torch.no_grad():
        for one, other in zip(ours.evaluate(ours.x0), published.evaluate(published.x0), strict=True):
            assert torch.equal(one, other)


def test_variables_rows_and_objective_follow_the_file(tmp_path, start):
    problem = of(
        tmp_path,
        """
        [objective]
        of = "segment.cruise.lift_to_drag"
        scale = 1.0
        maximize = true
        [variables.battery_mass]
        fixed = 900.0
        [variables.wing_area]
        upper = 20.0
        [constraints.stall_speed]
        drop = true
        [constraints.sound_pressure_level]
        upper = 65.0
        [constraints.span]
        of = "shape.wing.span"
        unit = "m"
        lower = 12.0
        upper = 13.0
        """,
    )
    rows = {row.name: row for row in problem.constraints}
    variables = {variable.name: variable for variable in problem.variables}
    assert "stall_speed" not in rows
    assert rows["sound_pressure_level"].upper == 65.0
    assert (rows["span"].lower, rows["span"].upper, rows["span"].unit) == (12.0, 13.0, "m")
    assert (variables["battery_mass"].lower, variables["battery_mass"].upper) == (900.0, 900.0)
    assert variables["wing_area"].upper == 20.0
    with torch.no_grad():
        objective, _ = problem.evaluate(problem.x0)
        batch, _ = problem.evaluate(problem.x0.expand(2, -1))
    assert float(objective) == pytest.approx(-float(start.segment("cruise").lift_to_drag), rel=1e-12)
    assert batch.shape == (2,)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[variables.wing_are]\nfixed = 1.0", "variables.wing_are is not a variable; it must be one of rotor_radius"),
        ("[variables.wing_area]\nfixed = 1.0\nlower = 2.0", "it must have fixed, or some of lower, upper and initial"),
        ("[variables.wing_area]\nlower = 30.0", "variables.wing_area is invalid: lower = 30 must not exceed upper"),
        ("[variables.wing_area]\ninitial = 30.0", "wing_area = 30 m^2 at the start is invalid"),
        ("[constraints.new]\nupper = 1.0", "constraints.new.of is missing"),
        ("[constraints.new]\ndrop = true\nof = 'gross_mass'", "drop = true is invalid beside of"),
        ("[constraints.new]\nof = 'gross_mass'", "it must have lower, upper or both, or drop = true"),
        ("[constraints.new]\nof = 'gross_mass'\nlower = 2.0\nupper = 1.0", "lower = 2 must not exceed upper = 1"),
        ("[constraints.new]\nof = 'segment.taxi.power'\nupper = 1.0", "'taxi' is no segment; there are hover, climb"),
        ("[constraints.new]\nof = 'rotor.pusher.hover.power'\nupper = 1.0", "'pusher' does not turn in 'hover'"),
        ("[constraints.new]\nof = 'mass.motor'\nupper = 1.0", "'motor' must be one of wing, fuselage"),
        ("[constraints.new]\nof = 'segment.hover.lift'\nupper = 1.0", "'lift' is not defined there"),
        ("[constraints.new]\nof = 'vehicle.name'\nupper = 1.0", "it must be a number of the analysis"),
        ("[constraints.new]\nof = 'vehicle.model_fields'\nupper = 1.0", "'model_fields' must be one of battery, booms"),
        ("[constraints.new]\nof = 'gross_mass.data'\nupper = 1.0", "'data' is not defined there"),
        ("[objective]\nof = 'energy.power'\nscale = 1.0", "it must be one number, not 3"),
        (
            "[objective]\nof = 'gross_mass'\nscale = 0.0",
            "objective.scale = 0.0 is not allowed; it must lie between 1e-12",
        ),
        (
            "[variables.wing_area]\nfixed = -5.0",
            "variables.wing_area.fixed = -5 m^2 is invalid: it must lie between 0.5 and 100",
        ),
        (
            "[variables.wing_area]\nfixed = 0.0",
            "variables.wing_area.fixed = 0 m^2 is invalid: it must lie between 0.5 and 100",
        ),
        (
            "[variables.rotor_radius]\nlower = -1.0",
            "variables.rotor_radius.lower = -1 m is invalid: it must lie between 0.2 and 10",
        ),
        ("[variables.motor_length]\nupper = 3.0", "variables.motor_length.upper = 3 m is invalid"),
        ("[variables.blade_chord]\nfixed = 0.0", "variables.blade_chord.fixed = 0 m is invalid"),
        (
            "[variables.blade_twist]\nfixed = 100.0",
            "variables.blade_twist.fixed = 100 rad is invalid: it must lie between -0.17",
        ),
        ("[variables.pusher_speed]\nfixed = 1e6", "variables.pusher_speed.fixed = 1e+06 rad/s is invalid"),
        ("[variables.cruise_altitude]\nupper = 1e6", "upper = 1e+06 m is invalid: it must lie between -2000 and 11000"),
        (
            "[variables.battery_position]\nfixed = 50.0",
            "battery_position.fixed = 50 m is invalid: it must lie between 0.751 and 9.72",
        ),
        ("[variables.tail_position]\nlower = 1.0", "tail_position.lower = 1 m is invalid: it must lie between 4.6"),
        (
            "[objective]\nof = 'gross_mass'\nscale = 1e-308",
            "objective.scale = 1e-308 is not allowed; it must lie between 1e-12",
        ),
        (
            "[objective]\nof = 'gross_mass'\nscale = true",
            "objective.scale = True is not allowed; it must be a finite number",
        ),
        (
            "[constraints.new]\nof = 'gross_mass'\nupper = 1e300",
            "constraints.new.upper = 1e+300 is not allowed; it must lie",
        ),
        (
            "[constraints.new]\nof = 'gross_mass'\nupper = true",
            "constraints.new.upper = True is not allowed; it must be a finite",
        ),
        (
            "[constraints.new]\nof = 'gross_mass'\nupper = '13'",
            "constraints.new.upper = '13' is not allowed; it must be a finite",
        ),
        ("[constraints.new]\nof = 'gross_mass'\nunit = \"\\u0000\"\nupper = 1.0", "constraints.new.unit"),
        ("[constraints.'$x$']\nof = 'gross_mass'\nupper = 1.0", "its name must be a word of ASCII letters"),
        ("[constraints.'a,b']\nof = 'gross_mass'\nupper = 1.0", "its name must be a word of ASCII letters"),
        ("formulation = 'aeroacoustic'", "formulation = 'aeroacoustic' is not allowed"),
        ("colour = 'red'", "colour is not a known key"),
    ],
)
def test_a_wrong_file_is_refused_in_one_sentence(tmp_path, text, message):
    with pytest.raises(ConfigurationError) as error:
        of(tmp_path, text)
    assert message in str(error.value)
    assert str(error.value).startswith(str(tmp_path / "problem.toml"))
    assert "\n" not in str(error.value)


def test_one_end_of_a_block_whose_elements_have_bounds_of_their_own(tmp_path):
    problem = of(tmp_path, "[variables.rotor_radius]\nlower = 0.9")
    (radius,) = (variable for variable in problem.variables if variable.name == "rotor_radius")
    assert radius.lower == (0.9,) * 9
    assert radius.upper == (1.8,) * 8 + (1.644,)


def test_rotors_that_a_problem_file_lets_touch_have_a_row(tmp_path):
    """Front and rear disk of a boom stand 4.3 m apart: no bound of the vehicle file lets them touch, this one does."""
    names = {row.name for row in of(tmp_path, "[variables.rotor_radius]\nupper = 2.5").constraints}
    published = {row.name for row in gross_weight_problem(*load()).constraints}
    assert names - published == {"tip_clearance_boom_1", "tip_clearance_boom_2"}


def test_numbers_of_the_analysis_by_name(start):
    for name, value in (
        ("gross_mass", start.gross_mass),
        ("mass.battery", start.design.battery_mass),
        ("design.wing_area", start.design.wing_area),
        ("rotor.pusher.climb.tip_mach", start.rotor("pusher", "climb").tip_mach),
        ("weights.total.center_of_gravity", start.weights.total.center_of_gravity),
    ):
        torch.testing.assert_close(quantity(name, start)(start), value, rtol=0.0, atol=0.0)
    assert quantity("scaled_trim", start)(start).shape == (18,)
