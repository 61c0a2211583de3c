"""A run that does not converge says why: on problems small enough to know the answer."""

from dataclasses import replace

import pytest
import torch

from lpc_mdo.optimization import Options, minimize_problem
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable
from lpc_mdo.reporting.diagnosis import diagnose, words

OBJECTIVE = {"name": "mass", "unit": "kg"}


def tank(lift_needed: float, largest_span: float = 10.0) -> Problem:
    """Lift = 2 span + area must hold a weight, drag = span + area stay below 3: they part at a lift of 3 + largest span."""
    return Problem(
        name="tank",
        formulation="paper",
        variables=(Variable("span", "m", 0.0, largest_span, 1.0), Variable("area", "m^2", 0.0, 10.0, 1.0)),
        constraints=(
            Constraint("lift", "N", lambda a: 2.0 * a["span"] + a["area"], lower=lift_needed, scale=2.0),
            Constraint("drag", "N", lambda a: a["span"] + a["area"], upper=3.0, scale=0.5),
        ),
        objective=Objective("mass", "kg", lambda a: 100.0 * (a["span"] ** 2 + a["area"]), scale=100.0),
        analyze_design=lambda values: values,
        complete=lambda values: values,
    )


def solve(problem: Problem, options: Options | None = None):
    limits = problem.lower, problem.upper, problem.constraint_lower, problem.constraint_upper
    return minimize_problem(problem.evaluate, problem.x0, *limits, options=options, is_batched=True, solver="sqp")


def test_fighting_constraints_the_bound_in_the_way_and_what_to_relax_are_named():
    problem = tank(lift_needed=6.0, largest_span=2.0)  # span 2 and drag 3 leave a lift of 5
    result = solve(problem)
    assert result.status == "infeasible"
    diagnosis = diagnose(problem, result)
    assert {entry.constraint for entry in diagnosis.conflicts} == {"lift", "drag"}
    assert sum(entry.share for entry in diagnosis.conflicts) == pytest.approx(1.0)
    assert [(entry.variable, entry.side, entry.bound) for entry in diagnosis.bounds] == [("span", "upper", 2.0)]
    relaxed = {entry.constraint: entry.relaxed for entry in diagnosis.relaxations}
    assert relaxed == pytest.approx({"lift": 5.0, "drag": 4.0}, abs=1e-6)
    text = "\n".join(words(diagnosis.model_dump(), OBJECTIVE, result.status))
    assert "lift: " in text
    assert "at least 6 asked" in text
    assert "largest span 2 m (1 of 1)" in text
    assert "drag: 3 -> 4 N" in text


def test_a_limit_is_not_moved_to_where_it_makes_no_sense():
    problem = tank(lift_needed=6.0, largest_span=2.0)
    lift, drag = problem.constraints
    rows = (replace(lift, limits_within=(5.5, 10.0)), replace(drag, limits_within=(0.0, 4.5)))
    problem = Problem(**{**_fields(problem), "constraints": rows})
    diagnosis = diagnose(problem, solve(problem))
    assert [entry.constraint for entry in diagnosis.relaxations] == ["drag"], "a lift of 5 is below what makes sense"


@pytest.mark.parametrize("limit", ["lift", "drag"])
def test_the_relaxation_it_names_makes_the_problem_feasible(limit):
    problem = tank(lift_needed=5.0 if limit == "lift" else 6.0, largest_span=2.0)
    if limit == "drag":
        lift, drag = problem.constraints
        moved = Constraint(drag.name, drag.unit, drag.of, upper=4.0, scale=drag.scale)
        problem = Problem(**{**_fields(problem), "constraints": (lift, moved)})
    assert solve(problem).status == "converged"


def test_a_run_stopped_too_early_is_not_told_to_relax_anything():
    problem = tank(lift_needed=5.5, largest_span=3.0)
    result = solve(problem, Options(newton_iterations=0, outer_iterations=1, inner_iterations=1))
    assert result.status == "iteration_limit"
    diagnosis = diagnose(problem, result)
    assert diagnosis.conflicts
    assert diagnosis.is_within_reach
    assert diagnosis.relaxations == ()
    assert "--resume" in words(diagnosis.model_dump(), OBJECTIVE, "time_limit")[-1]
    ended = words(diagnosis.model_dump(), OBJECTIVE, result.status)[-1]
    assert "--resume" not in ended, "it would end at the same point"
    assert "--starts" in ended


def _fields(problem: Problem) -> dict:
    names = ("name", "formulation", "variables", "objective", "analyze_design", "complete")
    return {name: getattr(problem, name) for name in names}


def test_prices_of_limits_are_told_where_a_run_was_stopped_at_a_feasible_point():
    problem = tank(lift_needed=4.0)
    result = solve(problem, Options(stationarity_tolerance=1e-30, newton_iterations=12, outer_iterations=1))
    assert result.status == "iteration_limit"
    diagnosis = diagnose(problem, result)
    # min span^2 + area with 2 span + area = 4 and area >= 0: span = 1, area = 2, and 100 kg for every newton.
    assert diagnosis.conflicts == ()
    assert torch.allclose(result.x, problem.scaled({"span": [1.0], "area": [2.0]}), atol=1e-6)
    (lift,) = diagnosis.prices[:1]
    assert lift.constraint == "lift"
    assert lift.value == pytest.approx(100.0, rel=1e-4)
    assert (
        "limit of lift up by 1 N: +100 kg (+220.5 lb) mass"
        in words(diagnosis.model_dump(), OBJECTIVE, result.status)[1]
    )
