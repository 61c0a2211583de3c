"""Solvers on problems with known optima, and on problems that have none."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
import torch
from hock_schittkowski import FLAT, PROBLEMS, TIGHT, optimum, solve, violation

from lpc_mdo.optimization import Hooks, Options, minimize
from lpc_mdo.optimization.certificate import certify, least_squares_multipliers
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.newton import refine, start_point
from lpc_mdo.optimization.presolve import presolve


@pytest.mark.parametrize("solver", ["sqp", "augmented-lagrangian"])
@pytest.mark.parametrize("case", PROBLEMS, ids=lambda case: case["name"])
def test_hock_schittkowski_optimum(case, solver):
    tight = replace(TIGHT, stationarity_tolerance=FLAT.get(case["name"], TIGHT.stationarity_tolerance))
    result = solve(case, options=tight, solver=solver)
    assert result.status == "converged", result.message
    assert result.objective == pytest.approx(optimum(case), rel=1e-6, abs=1e-6)
    assert violation(case, result.x) <= 1e-8


@pytest.mark.parametrize("solver", ["slsqp", "trust-constr", "ipopt"])
def test_peers_reach_the_same_optimum_through_the_same_interface(solver):
    if solver == "ipopt":
        pytest.importorskip("cyipopt")
    case = next(case for case in PROBLEMS if case["name"] == "HS71")
    assert solve(case, solver=solver).objective == pytest.approx(case["f_opt"], rel=1e-5)


def two_variables(*values):
    return torch.tensor(values, dtype=torch.float64)


INFEASIBLE = {
    "crossed limits of one quantity": (lambda x: torch.stack([x[0] + x[1], x[0] + x[1]]), (-9.0, 1.0), (0.0, 9.0)),
    "circle out of reach of a line": (lambda x: torch.stack([x @ x, x[0]]), (-9.0, 3.0), (1.0, 9.0)),
    "square below zero": (lambda x: ((x - 1.0) ** 2).sum()[None], (-9.0,), (-1.0,)),
}


@pytest.mark.parametrize("name", INFEASIBLE)
def test_infeasible_problem_is_recognized(name):
    rows, lower, upper = INFEASIBLE[name]
    result = minimize(
        lambda x: x[0] + x @ x,
        two_variables(0.3, -0.2),
        two_variables(-5.0, -5.0),
        two_variables(5.0, 5.0),
        rows,
        two_variables(*lower),
        two_variables(*upper),
    )
    assert result.status == "infeasible", result


def test_least_violation_of_an_infeasible_problem_is_told():
    # x >= 3 and x <= 1 are both missed by one at best.
    result = minimize(
        lambda x: x @ x,
        two_variables(0.0, 0.0),
        constraints=lambda x: torch.stack([x[0], x[0]]),
        constraint_lower=two_variables(3.0, -99.0),
        constraint_upper=two_variables(99.0, 1.0),
    )
    assert result.status == "infeasible"
    assert float(result.x[0]) == pytest.approx(2.0, abs=1e-3)
    assert "1" in result.message


UNBOUNDED = {
    "line": (lambda x: -x[0] - x[1], None, None, None),
    "saddle along a constraint": (
        lambda x: x[0] ** 2 - x[1] ** 2,
        lambda x: (x[0] - 0.1 * x[1])[None],
        two_variables(0.0)[:1],
        two_variables(0.0)[:1],
    ),
}


@pytest.mark.parametrize("name", UNBOUNDED)
def test_unbounded_problem_is_recognized(name):
    objective, rows, lower, upper = UNBOUNDED[name]
    result = minimize(
        objective, two_variables(0.5, 0.6), constraints=rows, constraint_lower=lower, constraint_upper=upper
    )
    assert result.status == "unbounded", result


def test_multipliers_are_the_objective_s_slope_in_the_limits():
    # min x^2 + y^2 with x + 2 y >= b has f = b^2/5, so df/db = 2 b/5 = minus the multiplier on the lower limit.
    b = 3.0
    result = minimize(
        lambda x: x @ x,
        two_variables(0.0, 0.0),
        constraints=lambda x: (x[0] + 2 * x[1])[None],
        constraint_lower=two_variables(b)[:1],
    )
    assert result.status == "converged"
    assert float(result.multipliers[0]) == pytest.approx(-2 * b / 5, rel=1e-3)


def test_failed_evaluations_are_stepped_back_from():
    def objective(x):
        return -torch.log(1.0 - x @ x) + (x[0] - 2.0) ** 2  # NaN outside the unit circle

    result = minimize(objective, two_variables(0.0, 0.1), two_variables(-9.0, -9.0), two_variables(9.0, 9.0))
    assert result.status == "converged"
    assert float(result.x @ result.x) < 1.0
    assert abs(float(result.x[1])) < 1e-3


def test_a_start_at_which_the_model_fails_is_refused():
    with pytest.raises(ValueError, match="start is not allowed"):
        minimize(lambda x: torch.log(x[0]), two_variables(-1.0, 0.0))


def test_crossed_bounds_and_unknown_solvers_are_refused():
    with pytest.raises(ValueError, match="bounds are not allowed"):
        minimize(lambda x: x @ x, two_variables(0.0, 0.0), two_variables(1.0, 1.0), two_variables(0.0, 2.0))
    with pytest.raises(ValueError, match="must be one of"):
        minimize(lambda x: x @ x, two_variables(0.0, 0.0), solver="simplex")


OURS = ("sqp", "augmented-lagrangian")


def rosenbrock_in_a_disk(hooks=None, state=None, options=None, solver="sqp"):
    return minimize(
        lambda x: 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2,
        two_variables(-1.2, 1.0),
        constraints=lambda x: (x @ x)[None],
        constraint_upper=two_variables(1.0)[:1],
        hooks=hooks,
        state=state,
        options=options,
        solver=solver,
    )


@pytest.mark.parametrize("solver", OURS)
def test_restart_from_any_checkpoint_reaches_the_same_optimum(solver):
    states = []
    hooks = Hooks(checkpoint=lambda state: states.append(json.loads(json.dumps(state))))
    whole = rosenbrock_in_a_disk(hooks, solver=solver)
    assert whole.status == "converged"
    assert len(states) > 1
    for state in states:
        assert torch.equal(rosenbrock_in_a_disk(state=state, solver=solver).x, whole.x)


def test_same_start_gives_the_same_bits():
    first, second = rosenbrock_in_a_disk(), rosenbrock_in_a_disk()
    assert torch.equal(first.x, second.x)
    assert first.objective == second.objective


def test_iteration_and_time_limits_are_told():
    short = Options(outer_iterations=1, inner_iterations=3, newton_iterations=2)
    assert rosenbrock_in_a_disk(options=short).status == "iteration_limit"
    assert rosenbrock_in_a_disk(options=Options(time_limit=1e-9)).status == "time_limit"


def test_the_time_limit_holds_between_newton_steps_too(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def jump(record):
        if record.phase == "Newton":
            now[0] = 100.0

    tight = Options(stationarity_tolerance=1e-12, feasibility_tolerance=1e-14, time_limit=10.0)
    result = rosenbrock_in_a_disk(Hooks(progress=jump), options=tight)
    assert result.status == "time_limit"
    assert [record.phase for record in result.history].count("Newton") == 1


def disk_evaluator() -> Evaluator:
    one = np.ones(1)
    free = np.full(2, np.inf)
    return Evaluator(lambda x: (x.sum(), (x @ x)[None]), -free, free, one, one)


def test_newton_s_method_converges_quadratically():
    evaluator = disk_evaluator()
    errors = []

    def report(point):
        errors.append(float(np.abs(point.x + 1.0 / np.sqrt(2.0)).max()))

    start = start_point(evaluator, np.array([-0.8, -0.6]), np.array([0.7]))
    found = refine(evaluator, replace(start, damping=0.0), 1e-9, 1e-11, 10, report).point
    assert found.certificate.holds(1e-9, 1e-11)
    assert found.multipliers[0] == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-9)
    assert errors[1] < 2.0 * errors[0] ** 2
    assert errors[2] < 2.0 * errors[1] ** 2 + 1e-12


@pytest.mark.parametrize("is_batched", [True, False])
def test_second_derivatives_of_the_lagrangian(is_batched):
    def evaluate(x):
        rows = torch.stack([x[..., 0] * x[..., 1] ** 2, x[..., 0] ** 2], dim=-1)
        return torch.exp(x[..., 0]) * x[..., 1], rows

    free = np.full(2, np.inf)
    evaluator = Evaluator(evaluate, -free, free, np.zeros(2), np.ones(2), 2.0, np.array([0.5, 3.0]), is_batched)
    x, y = 0.3, -0.7
    exact = 2.0 * np.exp(x) * np.array([[y, 1.0], [1.0, 0.0]])
    exact += 0.5 * 1.5 * np.array([[0.0, 2 * y], [2 * y, 2 * x]]) + 3.0 * (-2.0) * np.array([[2.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(evaluator.hessian(np.array([x, y]), np.array([1.5, -2.0])), exact, atol=2e-4)
    rows = np.array([[0.5 * y**2, x * y], [6.0 * x, 0.0]])
    np.testing.assert_allclose(evaluator.jacobian(np.array([x, y])), rows, atol=1e-12)


def chained_equations():
    """min |x - t|^2 with x1 = x0, 2 x2 + x0 = 1 and a sphere: two rows that can be solved, one that cannot."""
    target = torch.tensor([0.9, 0.2, 0.4, -0.3], dtype=torch.float64)

    def rows(x):
        return torch.stack([x[1] - x[0], 2.0 * x[2] + x[0], x @ x])

    limits = torch.tensor([0.0, 1.0, 0.5], dtype=torch.float64)
    return lambda x: ((x - target) ** 2).sum(), rows, limits


def test_equations_of_two_variables_are_solved_beforehand():
    objective, rows, limits = chained_equations()
    evaluator = Evaluator(
        lambda x: (objective(x), rows(x)),
        np.full(4, -1.0),
        np.array([1.0, 1.0, 0.4, 1.0]),
        limits.numpy(),
        limits.numpy(),
    )
    solved = presolve(evaluator, np.array([0.1, 0.2, 0.3, 0.4]))
    assert solved.rows.tolist() == [2]
    assert len(solved.variables) == 2
    x = solved.expand(solved.restrict(np.array([0.5, 0.5, 0.25, 0.1])))
    np.testing.assert_allclose(rows(torch.from_numpy(x))[:2], limits[:2], atol=1e-14)
    # 2 x2 = 1 - x0 <= 0.8 leaves x0 >= 0.2.
    leader = solved.variables.tolist().index(0)
    assert solved.lower[leader] == pytest.approx(0.2)


def test_multipliers_of_solved_rows_are_those_of_the_whole_problem():
    objective, rows, limits = chained_equations()
    start = torch.tensor([0.5, 0.4, 0.2, 0.1], dtype=torch.float64)
    result = minimize(
        objective, start, constraints=rows, constraint_lower=limits, constraint_upper=limits, options=TIGHT
    )
    assert result.status == "converged"
    for k in range(2):
        shifted = []
        for change in (1e-4, -1e-4):
            moved = limits.clone()
            moved[k] += change
            shifted.append(
                minimize(
                    objective, start, constraints=rows, constraint_lower=moved, constraint_upper=moved, options=TIGHT
                )
            )
        slope = (shifted[0].objective - shifted[1].objective) / 2e-4
        assert float(result.multipliers[k]) == pytest.approx(-slope, rel=1e-4)


def test_least_squares_multipliers_solve_the_optimality_conditions():
    evaluator, optimum = disk_evaluator(), -np.ones(2) / np.sqrt(2.0)
    multipliers = least_squares_multipliers(evaluator, optimum, active_tolerance=1e-6)
    assert multipliers[0] == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-12)
    assert certify(evaluator, optimum, multipliers).stationarity < 1e-12


def test_affine_rows_are_differentiated_once():
    def evaluate(x):
        return x @ x, torch.stack([x[0] + x[1], x[0] * x[1]])

    limit = np.zeros(2)
    evaluator = Evaluator(evaluate, -np.ones(2), np.ones(2), limit, limit)
    evaluator.jacobian(np.array([0.1, 0.2]))
    before = evaluator.counts.gradients
    jacobian = evaluator.jacobian(np.array([0.4, -0.3]))
    assert evaluator.counts.gradients - before == 1
    np.testing.assert_allclose(jacobian, [[1.0, 1.0], [-0.3, 0.4]], atol=1e-12)
