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
        ("[objective]\nof = 'gross_mass'\nscale = 0.0", "objective.scale = 0.0 is not allowed; it must be above 0"),
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
