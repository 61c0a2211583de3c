"""Many problems at once: the same optima as one at a time, and every problem with a state of its own."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from conftest import REFERENCE
from hock_schittkowski import OTHER_OPTIMUM, bounds, expression

from lpc_mdo.config import load
from lpc_mdo.optimization import Options, minimize_problem
from lpc_mdo.optimization.batched import minimize_batch
from lpc_mdo.optimization.batched_functions import BatchedFunctions
from lpc_mdo.optimization.batched_lbfgs import minimize_in_boxes
from lpc_mdo.optimization.certificate import certify
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.problems.aeroacoustic import WeightedSum, aeroacoustic_front
from lpc_mdo.studies.together import solve_together

PROBLEMS = json.loads((REFERENCE / "hock_schittkowski.json").read_text())["problems"]
TIGHT = Options(stationarity_tolerance=1e-6, feasibility_tolerance=1e-10, outer_iterations=60, inner_iterations=500)


class HockSchittkowski:
    """All problems of the set as one batch: variables and rows that a problem lacks are fixed, or free rows of zero."""

    def __init__(self, cases):
        self.cases = cases
        self.n = max(case["n"] for case in cases)
        self.m = max(len(case["equalities"]) + len(case["inequalities"]) for case in cases)
        self.objectives = [expression(case["objective"]) for case in cases]
        self.rows = [[expression(t) for t in [*case["equalities"], *case["inequalities"]]] for case in cases]

    def evaluate(self, x, which):
        objectives, constraints = [], []
        for point, case in zip(x, which.tolist(), strict=True):
            used = point[: self.cases[case]["n"]]
            values = [torch.as_tensor(row(used), dtype=torch.float64) for row in self.rows[case]]
            objectives.append(self.objectives[case](used))
            constraints.append(torch.stack([*values, *[0.0 * point.sum()] * (self.m - len(values))]))
        return torch.stack(objectives), torch.stack(constraints)

    def padded(self, values, missing, size):
        return torch.tensor([*values, *[missing] * (size - len(values))], dtype=torch.float64)

    def arrays(self):
        starts, lower, upper, low, high = [], [], [], [], []
        for case in self.cases:
            least, most = (
                bounds(case[name], case["n"], end) for name, end in (("lower", -torch.inf), ("upper", torch.inf))
            )
            free = torch.full((case["n"],), torch.inf, dtype=torch.float64)
            starts.append(self.padded(case["x0"], 0.0, self.n))
            lower.append(self.padded((-free if least is None else least).tolist(), 0.0, self.n))
            upper.append(self.padded((free if most is None else most).tolist(), 0.0, self.n))
            equal, other = len(case["equalities"]), len(case["inequalities"])
            low.append(self.padded([0.0] * (equal + other), -torch.inf, self.m))
            high.append(self.padded([0.0] * equal, torch.inf, self.m))
        return [torch.stack(rows) for rows in (starts, lower, upper, low, high)]


@pytest.fixture(scope="module")
def hock_schittkowski():
    # Scaled by its slope at the start, the objective of HS64 is nearly flat at the optimum.
    flat = [case for case in PROBLEMS if case["name"] == "HS64"]
    found = {}
    for cases, options in (
        ([case for case in PROBLEMS if case not in flat], TIGHT),
        (flat, replace(TIGHT, stationarity_tolerance=1e-8)),
    ):
        batch = HockSchittkowski(cases)
        results = minimize_batch(batch.evaluate, *batch.arrays(), options)
        found |= dict(zip((case["name"] for case in cases), results, strict=True))
    return found


@pytest.mark.parametrize("case", PROBLEMS, ids=lambda case: case["name"])
def test_hock_schittkowski_optimum_out_of_one_batch(case, hock_schittkowski):
    result = hock_schittkowski[case["name"]]
    assert result.status == "converged", (result.message, result.certificate)
    assert result.objective == pytest.approx(OTHER_OPTIMUM.get(case["name"], case["f_opt"]), rel=1e-6, abs=1e-6)


def circle_batch(failing=lambda x: torch.zeros(len(x), dtype=torch.bool)):
    """min a x + y within the circle x^2 + y^2 <= r^2 of each problem: optimum -r sqrt(1 + a^2)."""
    slopes, radii = torch.tensor([0.5, 1.0, 2.0, -3.0]).double(), torch.tensor([1.0, 2.0, 0.5, 1.5]).double()
    asked = []

    def evaluate(x, which):
        asked.append(which.tolist())
        if bool(failing(x.detach()).any()):
            raise FloatingPointError("no solution")
        return slopes[which] * x[:, 0] + x[:, 1], (x**2).sum(-1, keepdim=True)

    start = torch.tensor([[0.1, -0.2]]).double().expand(4, 2)
    free = torch.full((4, 2), torch.inf).double()
    arguments = (evaluate, start, -free, free, torch.full((4, 1), -torch.inf).double(), radii[:, None] ** 2)
    return arguments, -radii * (1.0 + slopes**2).sqrt(), asked


def test_every_problem_keeps_its_own_multiplier_and_optimum():
    """d optimum / d r^2 = -sqrt(1 + a^2)/(2 r): each problem's own, whatever the others do."""
    arguments, optima, _ = circle_batch()
    results = minimize_batch(*arguments, options=TIGHT)
    radius = arguments[5].sqrt()[:, 0]
    for result, optimum, r in zip(results, optima.tolist(), radius.tolist(), strict=True):
        assert result.status == "converged"
        assert result.objective == pytest.approx(optimum, rel=1e-8)
        assert result.history[-1].objective == pytest.approx(optimum, rel=1e-8)
        assert [record.iteration for record in result.history] == list(range(1, len(result.history) + 1))
        assert float(result.multipliers[0]) == pytest.approx(-optimum / (2.0 * r * r), rel=1e-6)


def test_company_changes_no_optimum():
    arguments, _, _ = circle_batch()
    together = minimize_batch(*arguments, options=TIGHT)
    evaluate, *arrays = arguments
    for i, result in enumerate(together):
        (alone,) = minimize_batch(
            lambda x, which, i=i: evaluate(x, torch.full_like(which, i)), *[a[i : i + 1] for a in arrays], options=TIGHT
        )
        torch.testing.assert_close(alone.x, result.x, rtol=0.0, atol=1e-9)
        assert alone.counts == result.counts


def test_a_problem_whose_model_fails_at_a_point_steps_back_and_the_others_do_not_notice():
    """The model of all has no values right of x = 0.3, where none of the optima lies but the last's."""
    plain, failing = (circle_batch(f)[0] for f in (lambda x: x[:, 0] > 99.0, lambda x: x[:, 0] > 0.3))
    for one, other in list(zip(minimize_batch(*plain), minimize_batch(*failing), strict=True))[:3]:
        assert other.status == "converged"
        assert one.objective == pytest.approx(other.objective, rel=1e-6)


def test_finished_functions_leave_the_batch():
    """Parabolas of which the first starts at its bottom and the second is done in a step; Rosenbrock's valley takes long."""
    asked = []

    def function(x, which):
        asked.append(which.tolist())
        leaf = x.detach().requires_grad_(True)
        valley = 100.0 * (leaf[:, 1] - leaf[:, 0] ** 2) ** 2 + (1.0 - leaf[:, 0]) ** 2
        value = torch.where(which == 2, valley, (leaf**2).sum(-1))
        (gradient,) = torch.autograd.grad(value.sum(), leaf)
        return value.detach(), gradient

    start = torch.tensor([[0.0, 0.0], [0.3, 0.4], [-1.2, 1.0]]).double()
    free, tolerance = torch.full_like(start, torch.inf), torch.full((3,), 1e-8).double()
    x, steps = minimize_in_boxes(function, start, -free, free, tolerance, 500)
    torch.testing.assert_close(x, torch.tensor([[0.0, 0.0], [0.0, 0.0], [1.0, 1.0]]).double(), rtol=0.0, atol=1e-7)
    assert int(steps[0]) == 0
    assert asked[0] == [0, 1, 2]
    assert [0 in points for points in asked].count(True) == 1
    assert asked[-1] == [2]
    assert [1 in points for points in asked].count(True) < [2 in points for points in asked].count(True)


def test_bounds_hold_on_the_way_and_at_the_end():
    """Rosenbrock's valley cut at x <= 0.5: its end is (0.5, 0.25)."""
    seen = []

    def function(x, which):
        seen.append(x.detach().clone())
        leaf = x.detach().requires_grad_(True)
        value = 100.0 * (leaf[:, 1] - leaf[:, 0] ** 2) ** 2 + (1.0 - leaf[:, 0]) ** 2
        (gradient,) = torch.autograd.grad(value.sum(), leaf)
        return value.detach(), gradient

    start, upper = torch.tensor([[-1.2, 1.0]]).double(), torch.tensor([[0.5, torch.inf]]).double()
    lower = torch.full_like(start, -torch.inf)
    x, _ = minimize_in_boxes(function, start, lower, upper, torch.tensor([1e-8]).double(), 500)
    torch.testing.assert_close(x, torch.tensor([[0.5, 0.25]]).double(), rtol=0.0, atol=1e-7)
    assert float(torch.cat(seen)[:, 0].max()) <= 0.5


def test_derivatives_of_a_batch_are_those_of_its_problems_alone():
    """Jacobian, second derivatives and certificate beside those of the single solver's evaluator."""
    factor = torch.tensor([1.0, 3.0]).double()

    def evaluate(x, which):
        rows = torch.stack([x[:, 0] * x[:, 1] ** 2, factor[which] * x[:, 0] ** 2], dim=-1)
        return factor[which] * torch.exp(x[:, 0]) * x[:, 1], rows

    x, which = torch.tensor([[0.3, -0.7], [-0.2, 0.4]]).double(), torch.tensor([0, 1])
    free, low, high = torch.full_like(x, torch.inf), torch.tensor([[0.0, 0.1]] * 2).double(), torch.ones(2, 2).double()
    scales = torch.tensor([2.0, 0.5]).double(), torch.tensor([[0.5, 3.0], [1.0, 2.0]]).double()
    functions = BatchedFunctions(evaluate, -free, free, low, high, *scales)
    multipliers = torch.tensor([[1.5, -2.0], [0.3, 0.4]]).double()
    at = functions.derivatives(x, which)
    hessians = functions.hessians(x, which, multipliers, at.lagrangian_gradient(multipliers))
    certificates = functions.certificates(x, which, multipliers, at)
    for i in range(2):
        single = Evaluator(
            lambda y, i=i: tuple(part[0] for part in evaluate(y[None], torch.tensor([i]))),
            *(a[i].numpy() for a in (-free, free, low, high)),
            float(scales[0][i]),
            scales[1][i].numpy(),
        )
        point = x[i].numpy()
        np.testing.assert_allclose(at.jacobian[i], single.jacobian(point), rtol=1e-12)
        exact = single.hessian(point, multipliers[i].numpy())  # the batch's come from differences
        np.testing.assert_allclose(hessians[i], exact, rtol=1e-4, atol=1e-4)
        own = certify(single, point, multipliers[i].numpy())
        for name in ("stationarity", "feasibility", "complementarity"):
            assert getattr(certificates[i], name) == pytest.approx(getattr(own, name), rel=1e-12)


def test_crossed_bounds_are_refused():
    (evaluate, start, lower, upper, low, high), _, _ = circle_batch()
    with pytest.raises(ValueError, match="bounds are not allowed"):
        minimize_batch(evaluate, start, upper, lower, low, high)


def test_a_start_that_is_not_finite_harms_no_other():
    (evaluate, start, lower, upper, low, high), optima, _ = circle_batch()

    def failing(x, which):
        objective, rows = evaluate(x, which)
        return torch.where(which == 2, torch.nan, objective), rows

    results = minimize_batch(failing, start, lower, upper, low, high, TIGHT)
    assert results[2].status == "failed"
    assert "not finite at the start" in results[2].message
    for i in (0, 1, 3):
        assert results[i].status == "converged"
        assert results[i].objective == pytest.approx(float(optima[i]), rel=1e-8)


def test_infeasible_is_told_from_the_iteration_limit():
    """x^2 + y^2 <= r^2 with r^2 = -1 has no point; the others have theirs."""
    (evaluate, start, lower, upper, low, high), optima, _ = circle_batch()
    high = high.clone()
    high[1] = -1.0
    results = minimize_batch(evaluate, start, lower, upper, low, high)
    assert results[1].status == "infeasible"
    assert "no feasible design found" in results[1].message
    assert results[0].objective == pytest.approx(float(optima[0]), rel=1e-6)
    short = Options(outer_iterations=1, inner_iterations=1, newton_iterations=0)
    assert (
        minimize_batch(evaluate, start, lower, upper, low, high.clamp(min=0.25), short)[1].status == "iteration_limit"
    )


WEIGHTS = (0.0, 0.3, 0.8)


def test_quiet_and_efficient_blades_of_several_weights_at_once():
    """The 64-variable problem: certified, and the same optima as one at a time."""
    problems = aeroacoustic_front(*load(), [WeightedSum(weight) for weight in WEIGHTS])
    for result, problem in zip(solve_together(problems), problems, strict=True):
        alone = minimize_problem(
            problem.evaluate,
            problem.x0,
            problem.lower,
            problem.upper,
            problem.constraint_lower,
            problem.constraint_upper,
            is_batched=True,
        )
        assert result.status == alone.status == "converged"
        assert result.certificate.holds(1e-4, 1e-6)
        assert result.objective == pytest.approx(alone.objective, rel=1e-6)


def test_problems_of_different_analyses_are_not_solved_together():
    one, other = (
        aeroacoustic_front(*load(overrides=[f"vehicle.wing.area_m2={a}"]), [WeightedSum()])[0] for a in (18, 19)
    )
    with pytest.raises(ValueError, match="different analyses"):
        solve_together([one, other])
