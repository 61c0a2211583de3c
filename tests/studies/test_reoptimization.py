"""The envelope theorem against optima found anew: in closed form, and for the aircraft."""

import json

import pytest
import torch
from analytic_studies import distances
from click.testing import CliRunner
from conftest import REFERENCE
from stored_files import analysis, gross_weight_result, result, variable

from lpc_mdo.cli import main
from lpc_mdo.config import baseline
from lpc_mdo.reporting.sensitivities import sensitivities
from lpc_mdo.studies.reoptimization import check, gross_weight_changes
from lpc_mdo.studies.single import minimum


def optimum(problem, x=None):
    start = problem.x0 if x is None else x
    multipliers = None if x is None else torch.zeros_like(problem.constraint_lower)
    result = minimum(problem, start, multipliers=multipliers)
    assert result.status == "converged", result.message
    return result


def wall(place):
    """Squared distance from (1, 0) left of a wall at `place`: (1 - place)^2 for a place below 1."""
    problems = distances([place]).problems
    (problem,) = problems([place])
    result = optimum(problem)
    (found,) = check(problem, result.x, result.multipliers, {"wall": lambda factor: problems([factor * place])[0]})
    return found


def test_first_order_is_exact_and_the_sides_differ_by_the_curvature():
    """d (1 - p)^2 = -2 (1 - p) dp for one per cent of p = 0.6; either side is off by the square of that per cent."""
    found = wall(0.6)
    assert found.is_certified
    slope = -2.0 * 0.4 * 0.006
    assert found.envelope == pytest.approx(slope, rel=1e-4)  # the certificate's
    assert found.reoptimized == pytest.approx(slope, rel=1e-4)  # central differences of a parabola are exact
    assert found.one_sided == pytest.approx((slope - 0.006**2, slope + 0.006**2), rel=1e-4)
    assert found.changes == ()


def test_a_wall_that_begins_to_press_is_told():
    """At 1.005 the wall touches nothing; at 0.995 it does, and the envelope theorem cannot know."""
    found = wall(1.005)
    # A certificate leaves 1e-4 of a multiplier open, and the change is one per cent.
    assert found.envelope == pytest.approx(0.0, abs=1e-6)
    assert found.below.objective == pytest.approx((1.0 - 0.99 * 1.005) ** 2, rel=1e-3)
    assert found.above.objective == pytest.approx(0.0, abs=1e-9)
    assert found.changes == ("wall presses at -1%",)
    assert found.relative_difference == pytest.approx(1.0, rel=1e-2)  # that openness over the slope of 1e-5


def test_structural_mass_of_the_aircraft(problem):
    """One per cent more of it, by the stored chart's rule, by the Lagrangian of the whole problem, and optimized again."""
    stored = json.loads((REFERENCE / "optimum.json").read_text())
    result = optimum(problem, problem.scaled(stored["design"]))
    label = "structural mass factor"
    changes = gross_weight_changes(problem)
    (found,) = check(problem, result.x, result.multipliers, {label: changes[label]})
    assert found.is_certified
    assert found.envelope > 1.0  # kg
    # Half the third derivative's share of one per cent, and what a certificate of 1e-4 leaves open.
    assert found.reoptimized == pytest.approx(found.envelope, rel=1e-3)
    chart = {answer.label: answer.per_percent for answer in sensitivities(problem, result)}
    assert chart[label] == pytest.approx(found.envelope, rel=1e-6)


def test_every_parameter_and_limit_can_be_changed_and_changes_the_problem(problem):
    changes = gross_weight_changes(problem)
    assert len(changes) > 15
    x = problem.x0
    with torch.no_grad():
        f0, c0 = problem.evaluate(x)
        for label, change in changes.items():
            changed = change(1.01)
            f, c = changed.evaluate(x)
            limits = [
                torch.equal(getattr(changed, n), getattr(problem, n)) for n in ("constraint_lower", "constraint_upper")
            ]
            assert not (torch.equal(f, f0) and torch.equal(c, c0) and all(limits)), label


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "is not allowed; it must be the folder of a run or a study"),
        (("--of", "cruise speed"), "--of is not allowed without --verify"),
        (("--verify",), "is not allowed; it must be the folder of a run or a study"),
    ],
)
def test_sensitivities_of_what_is_no_run_are_refused(tmp_path, arguments, message):
    result = CliRunner().invoke(main, ["sensitivities", str(tmp_path / "nowhere"), *arguments])
    assert result.exit_code == 2
    assert message in result.stderr


def test_sensitivities_of_another_problem_and_of_an_unfinished_run_are_refused(tmp_path):
    for name, content in {
        "result.json": gross_weight_result(status="iteration_limit"),
        "analysis.json": analysis(),
        "configuration.json": {
            name: part.model_dump() for name, part in zip(("vehicle", "mission"), baseline(), strict=True)
        },
    }.items():
        (tmp_path / name).write_text(json.dumps(content))
    (tmp_path / "history.csv").write_text("evaluations,cost_1,violation,stationarity\n")
    (tmp_path / "evaluations.csv").write_text("evaluation,cost_1,sound_pressure_level,final_state_of_charge\n")
    unfinished = CliRunner().invoke(main, ["sensitivities", str(tmp_path), "--verify"])
    assert unfinished.exit_code == 2
    assert "status 'iteration_limit' is not allowed; it must be converged" in unfinished.stderr
    (tmp_path / "result.json").write_text(json.dumps(result([variable("x", 0.0, 1.0)], problem="own")))
    other = CliRunner().invoke(main, ["sensitivities", str(tmp_path)])
    assert other.exit_code == 2
    assert "problem 'own' is not allowed; it must be gross-weight" in other.stderr
