"""What solvers claim is true: problems from far starts, scaled, degenerate, without optimum, and large."""

import time

import numpy as np
import pytest
import torch
from optimization_problems import ALL, CLASSICS, FAR, STATIONARY, UNQUALIFIED, WITHOUT

from lpc_mdo.optimization import Hooks, Options, minimize

OURS = ("sqp", "augmented-lagrangian")
SOLVED = {case.name for case in [*CLASSICS, *FAR, *STATIONARY]}  # whose optimum is asked for, not only the truth


@pytest.mark.parametrize("solver", OURS)
@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_no_claim_is_false(case, solver):
    result = case.solve(solver=solver)
    assert not case.is_false(result), (result.status, result.objective, result.message)
    if case.name in SOLVED:
        assert result.status == "converged", result.message


@pytest.mark.parametrize("solver", OURS)
@pytest.mark.parametrize(
    "case", [case for case in UNQUALIFIED if case.expected == "failed"], ids=lambda case: case.name
)
def test_a_failed_constraint_qualification_is_no_optimum(case, solver):
    result = case.solve(solver=solver)
    assert result.status in ("failed", "iteration_limit")


@pytest.mark.parametrize("solver", OURS)
@pytest.mark.parametrize("case", WITHOUT, ids=lambda case: case.name)
def test_problems_without_an_optimum_are_told_by_kind(case, solver):
    result = case.solve(solver=solver)
    assert result.status == case.expected, result.message
    if case.expected == "infeasible":
        assert "no feasible design found" in result.message


def test_there_are_at_least_eighty_problems():
    assert len({case.name for case in ALL}) == len(ALL) >= 80


LARGE = 5000
WEIGHTS = torch.arange(1, LARGE + 1, dtype=torch.float64)


@pytest.mark.parametrize("solver", OURS)
def test_thousands_of_variables_need_hundreds_of_gradients(solver):
    result = minimize(lambda x: (WEIGHTS * (x - 1) ** 2).sum(), torch.zeros(LARGE), solver=solver)
    assert result.status == "converged", result.message
    assert float((result.x - 1).abs().max()) < 1e-6
    assert result.counts.gradients < LARGE


def test_many_variables_with_a_row():
    """The least weighted distance from ones on the plane sum x = n/2: the multiplier is that of the harmonic sum."""
    result = minimize(
        lambda x: (WEIGHTS * (x - 1) ** 2).sum(),
        torch.zeros(LARGE),
        constraints=lambda x: x.sum(),
        constraint_upper=LARGE / 2,
    )
    assert result.status == "converged", result.message
    assert result.objective == pytest.approx((LARGE / 2) ** 2 / float((1 / WEIGHTS).sum()), rel=1e-8)


def parabola(x):
    return ((x - 1) ** 2).sum()


@pytest.mark.parametrize("solver", [*OURS, "slsqp"])
def test_lists_scalar_rows_and_fixed_variables(solver):
    plain = minimize(parabola, [3, 4.0], solver=solver)
    assert plain.status == "converged"
    row = minimize(parabola, [3, 4.0], constraints=lambda x: x[0] + x[1], constraint_upper=1.0, solver=solver)
    assert row.objective == pytest.approx(0.5, rel=1e-6)
    fixed = minimize(parabola, [3, 4.0], lower=[0, 2.0], upper=[5, 2.0], solver=solver)
    assert fixed.x.tolist() == pytest.approx([1.0, 2.0], abs=1e-6)
    nothing = minimize(parabola, [3, 4.0], lower=[3, 2.0], upper=[3, 2.0], solver=solver)
    assert nothing.status == "converged"
    assert "leave one design" in nothing.message
    constant = minimize(lambda x: torch.tensor(3.0), [3, 4.0], solver=solver)
    assert (constant.status, constant.objective) == ("converged", 3.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"lower": [1.0]}, "lower of shape"),
        ({"upper": [1.0, float("nan")]}, "entry 1 is NaN"),
        ({"constraints": lambda x: x, "constraint_upper": [1.0]}, "constraint_upper of shape"),
        ({"lower": [2.0, 0.0], "upper": [1.0, 1.0]}, "2 above 1 in entry 0"),
        ({"x0": [float("nan"), 1.0]}, "x0 is invalid"),
        ({"x0": "ab"}, "x0 = 'ab' is invalid"),
        ({"x0": [[1.0, 2.0]]}, "x0 of shape"),
        ({"objective": lambda x: torch.log(x[0]), "x0": [-1.0, 1.0]}, "start is not allowed"),
        ({"objective": lambda x: torch.sqrt(x[0]), "x0": [0.0, 1.0]}, "gradient is not finite"),
    ],
)
def test_wrong_arguments_are_refused_in_one_sentence(arguments, words):
    with pytest.raises(ValueError, match=words) as refusal:
        minimize(**({"objective": parabola, "x0": [3.0, 4.0]} | arguments))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"time_limit": float("nan")}, "time_limit = nan is invalid"),
        ({"time_limit": -1.0}, "time_limit = -1 is invalid"),
        ({"stationarity_tolerance": float("nan")}, "stationarity_tolerance = nan is invalid"),
        ({"outer_iterations": 2.5}, "outer_iterations = 2.5 is invalid"),
    ],
)
def test_limits_and_tolerances_are_numbers_that_can_be(limits, words):
    with pytest.raises(ValueError, match=words):
        Options(**limits)


def test_a_failure_of_another_code_is_called_one():
    """Rows without any dependence: SLSQP's line search fails, which is no limit of iterations."""
    result = minimize(
        parabola, [3.0, 4.0], constraints=lambda x: torch.tensor([3.0]), constraint_upper=2.0, solver="slsqp"
    )
    assert result.status in ("failed", "infeasible")


@pytest.mark.parametrize("phase", ["restoration", "Newton", "augmented Lagrangian"])
def test_the_time_limit_holds_within_every_phase(monkeypatch, phase):
    """No more than one evaluation follows the moment at which time is over."""
    now, after = [0.0], []
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def objective(x):
        after.append(now[0] > 5.0)
        return 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2

    def watch(record):
        if record.phase == phase:
            now[0] = 10.0

    solver = "augmented-lagrangian" if phase == "augmented Lagrangian" else "sqp"
    result = minimize(
        objective,
        [-3.0, 4.0],
        constraints=lambda x: x @ x,
        constraint_upper=1.0,
        solver=solver,
        options=Options(time_limit=5.0),
        hooks=Hooks(progress=watch),
    )
    assert result.status == "time_limit"
    assert sum(after) <= 4  # the certificate of the point that is returned


def test_the_certificate_s_scale_is_that_of_its_point():
    """From near and far, the same objective has the same scale at its end."""
    scales = [
        minimize(lambda x: 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2, start).objective_scale
        for start in ([1.1, 1.2], [10.0, 10.0], [-50.0, 80.0])
    ]
    np.testing.assert_allclose(scales, scales[0])
