"""The nearest design that satisfies the constraints, or the one that misses them least.

Levenberg-Marquardt on half the sum of squared violations, bounds kept: each step solves a small quadratic programme in which
rows that hold take no part until the step would break them. Where that is slow, the violated rows' own second derivatives
join, as far as they are convex. Source: Nocedal and Wright, Numerical Optimization (2006),
ch. 10.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import piqp
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.certificate import LARGE, violation
from lpc_mdo.optimization.functions import Functions

FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-2, 1e-10, 1e6
GOOD, POOR = 0.3, 0.01  # share of the predicted gain from which damping falls, below which it rises
STALLED = 8, 0.9  # steps, and the share of the violation left after them, that are no progress
RESTORED = 1e-3  # scaled violation that counts as nearly feasible
SLOW = 3, 0.8  # steps, and the share of the violation left after them, from which second derivatives pay
STATIONARY = 1e-7  # predicted gain, relative to the violation's square, that is no gain


@dataclass(frozen=True)
class Restored:
    """x (n,) with its largest violation; `is_near`: that is as small as was asked."""

    x: np.ndarray
    violation: float
    is_near: bool


def restore(
    evaluator: Functions,
    x: np.ndarray,
    tolerance: float,
    damping: float = FIRST_DAMPING,
    iterations: int = 60,
    is_enough: Callable[[np.ndarray], bool] = lambda x: False,
    report: Callable[[np.ndarray, float], None] = lambda x, damping: None,
    past: Sequence[float] = (),
) -> Restored:
    """From x (n,) to a largest violation of at most `tolerance`, until no step lowers it, or until `is_enough`.

    `report` is told every point and the damping with which the search goes on from there; `past` are the largest
    violations of the steps that led to x, where a search that was stopped goes on: they count among its iterations.
    """
    if len(x) > LARGE:
        return _by_gradients(evaluator, x, tolerance, iterations, is_enough)
    missed = violation(evaluator.values(x)[1], *evaluator.limits)
    seen = list(past)
    is_slow = any(later > SLOW[1] * earlier for earlier, later in zip(seen, seen[SLOW[0] :], strict=False))
    is_slow = is_slow and len(x) <= LARGE
    while len(seen) < iterations:
        seen.append(float(np.abs(missed).max(initial=0.0)))
        if len(seen) > STALLED[0] and seen[-1] > STALLED[1] * seen[-1 - STALLED[0]]:
            break
        if seen[-1] <= tolerance or is_enough(x):
            break
        is_slow = is_slow or (len(seen) > SLOW[0] and seen[-1] > SLOW[1] * seen[-1 - SLOW[0]] and len(x) <= LARGE)
        stepped = _step(evaluator, x, missed, damping, is_slow)
        if stepped is None:
            break
        x, damping, missed = stepped
        report(x, damping)
    worst = float(np.abs(missed).max(initial=0.0))
    return Restored(x, worst, worst <= tolerance)


def _by_gradients(
    evaluator: Functions, x: np.ndarray, tolerance: float, iterations: int, is_enough: Callable[[np.ndarray], bool]
) -> Restored:
    """By L-BFGS on half the sum of squares, for many variables."""

    def square(x: np.ndarray) -> tuple[float, np.ndarray]:
        if not evaluator.is_finite(x):
            return 1e15, np.zeros_like(x)
        missed = violation(evaluator.values(x)[1], *evaluator.limits)
        return 0.5 * float(missed @ missed), evaluator.gradient(x, missed, 0.0)

    def worst(x: np.ndarray) -> float:
        return float(np.abs(violation(evaluator.values(x)[1], *evaluator.limits)).max(initial=0.0))

    def watch(x: np.ndarray) -> None:
        if worst(x) <= tolerance or is_enough(x):
            raise StopIteration

    if worst(x) > tolerance:
        settings = {"maxiter": 10 * iterations, "maxcor": 30, "ftol": 0.0, "gtol": 1e-12}
        limits = list(zip(evaluator.lower, evaluator.upper, strict=True))
        x = scipy_minimize(square, x, jac=True, method="L-BFGS-B", bounds=limits, callback=watch, options=settings).x
        x = np.clip(x, evaluator.lower, evaluator.upper)
    return Restored(x, worst(x), worst(x) <= tolerance)


def _step(
    evaluator: Functions, x: np.ndarray, missed: np.ndarray, damping: float, is_slow: bool
) -> tuple[np.ndarray, float, np.ndarray] | None:
    """The next point (n,), the damping there and its violations (m,); None where no step lowers the violation."""
    _, values = evaluator.values(x)
    jacobian = evaluator.jacobian(x)
    if not np.isfinite(jacobian).all():
        return None
    bend = _curvature(evaluator, x, missed) if is_slow else np.zeros((len(x), len(x)))
    before, is_raised = float(missed @ missed), False
    while damping <= LARGEST_DAMPING:
        step = _damped(evaluator, x, values, jacobian, bend + damping * np.eye(len(x)))
        if step is None:
            return None
        predicted = before - _square(values + jacobian @ step, evaluator) - float(step @ bend @ step)
        if predicted <= STATIONARY * before:
            if is_raised or damping <= SMALLEST_DAMPING:
                return None
            damping *= 0.1
            continue
        trial = np.clip(x + step, evaluator.lower, evaluator.upper)
        if evaluator.is_finite(trial):
            left = violation(evaluator.values(trial)[1], *evaluator.limits)
            share = (before - float(left @ left)) / predicted
            if share > POOR:
                return trial, max(0.1 * damping, SMALLEST_DAMPING) if share > GOOD else damping, left
        damping, is_raised = 10.0 * damping, True
    return None


def _curvature(evaluator: Functions, x: np.ndarray, missed: np.ndarray) -> np.ndarray:
    """The convex part (n, n) of the rows' second derivatives, weighted by their violations; zero where it is not finite."""
    try:
        hessian = evaluator.hessian(x, missed, 0.0)
    except ArithmeticError:
        return np.zeros((len(x), len(x)))
    if not np.isfinite(hessian).all():
        return np.zeros((len(x), len(x)))
    curvature, axes = np.linalg.eigh(hessian)
    return (axes * np.maximum(curvature, 0.0)) @ axes.T


def _square(values: np.ndarray, evaluator: Functions) -> float:
    missed = violation(values, *evaluator.limits)
    return float(missed @ missed)


def _damped(
    evaluator: Functions, x: np.ndarray, values: np.ndarray, jacobian: np.ndarray, hessian: np.ndarray
) -> np.ndarray | None:
    """The step (n,) that minimizes |violation of the linear rows|^2 + step . hessian step; None where the programme fails."""
    rows, count = jacobian.shape
    lower, upper = (limit - values for limit in evaluator.limits)
    is_equal = lower == upper
    matrix = np.hstack([jacobian, np.eye(rows)])
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    free = np.full(rows, np.inf)
    solver.setup(
        np.block([[hessian, np.zeros((count, rows))], [np.zeros((rows, count)), np.eye(rows)]]),
        np.zeros(count + rows),
        matrix[is_equal],
        lower[is_equal],
        matrix[~is_equal],
        lower[~is_equal],
        upper[~is_equal],
        np.concatenate([evaluator.lower - x, -free]),
        np.concatenate([evaluator.upper - x, free]),
    )
    if solver.solve() != piqp.Status.PIQP_SOLVED:
        return None
    return np.clip(solver.result.x[:count], evaluator.lower - x, evaluator.upper - x)
