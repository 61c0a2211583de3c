"""Whether there is a feasible design: least violations in closed form, valleys that bend, and verdicts of both solvers."""

import numpy as np
import pytest
import torch

from lpc_mdo.optimization import minimize
from lpc_mdo.optimization.elastic import CERTIFIED, Elastic, least_violation
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.feasibility import infeasibility

START = [-1.2, 1.0]
INFINITE = float("inf")


def valley(x):
    """Rows that lead along the bend y = x^2."""
    return torch.stack([10.0 * (x[..., 1] - x[..., 0] ** 2), x[..., 0], x[..., 1]], dim=-1)


def evaluator(highest):
    """On the bend, x at least 2 and y at most `highest`: there is a point if that is at least 4."""
    low, high = np.array([0.0, 2.0, -np.inf]), np.array([0.0, np.inf, highest])
    return Evaluator(lambda x: (x.sum(-1), valley(x)), np.full(2, -10.0), np.full(2, 10.0), low, high, is_batched=True)


def test_elastic_mode_follows_a_bend_to_a_feasible_point():
    found = least_violation(evaluator(4.0), np.array(START), 1e-8)
    assert found.violation <= 1e-8
    assert found.x == pytest.approx([2.0, 4.0], abs=1e-7)


def test_the_least_violation_is_certified():
    """All rows are missed by the same t: 10 (3 + t - (2 - t)^2) = -t."""
    found = least_violation(evaluator(3.0), np.array(START), 1e-8)
    least = min(np.roots([-10.0, 51.0, -10.0]).real)
    assert found.violation == pytest.approx(least, rel=1e-8)
    assert found.x == pytest.approx([2.0 - least, 3.0 + least], abs=1e-7)
    assert found.slope <= CERTIFIED


def test_derivatives_of_the_elastic_problem():
    """Against differences; rows with one limit appear once, the equation twice."""
    elastic, z = Elastic(evaluator(3.0)), np.array([0.3, -0.7, 1.9])
    _, rows = elastic.values(z)
    assert rows == pytest.approx([10.0 * (-0.7 - 0.09) + 1.9, 0.3 + 1.9, 10.0 * (-0.7 - 0.09) - 1.9, -0.7 - 1.9])
    step, weights = 1e-6, np.array([0.3, -0.2, 0.7, 1.1])
    moved = [elastic.values(z + step * axis)[1] for axis in np.eye(3)]
    assert elastic.jacobian(z) == pytest.approx((np.array(moved) - rows).T / step, abs=1e-4)
    gradients = [elastic.gradient(z + step * axis, weights) for axis in np.eye(3)]
    assert elastic.hessian(z, weights) == pytest.approx(
        (np.array(gradients) - elastic.gradient(z, weights)) / step, abs=1e-4
    )


@pytest.mark.parametrize("solver", ["sqp", "augmented-lagrangian"])
@pytest.mark.parametrize(("highest", "status"), [(4.5, "converged"), (3.0, "infeasible"), (3.99, "infeasible")])
def test_both_solvers_tell_the_truth_of_a_bend(solver, highest, status):
    result = minimize(
        lambda x: x.sum(),
        START,
        lower=-10.0,
        upper=10.0,
        constraints=valley,
        constraint_lower=[0.0, 2.0, -INFINITE],
        constraint_upper=[0.0, INFINITE, highest],
        solver=solver,
    )
    assert result.status == status, result.message
    if status == "infeasible":
        assert "no feasible design found from 4 starts" in result.message


def test_a_feasible_point_of_another_start_refutes_infeasibility():
    """Between two humps the violation has a least value that is not zero; beyond them there are feasible points."""

    def rows(x):
        return x.sum(-1), (x**4 - 2.0 * x**2)[..., :1]

    low, high = np.array([0.5]), np.array([np.inf])  # x^4 - 2 x^2 >= 1/2 beyond 1.49; zero is a stationary maximum
    whole = Evaluator(rows, np.full(1, -3.0), np.full(1, 3.0), low, high, is_batched=True)
    assert infeasibility(whole, np.array([0.0]), 1e-6) is None
