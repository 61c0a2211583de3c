"""The nearest design that satisfies the constraints, or the one that misses them least.

Levenberg-Marquardt on half the sum of squared violations, bounds kept: each step solves a small quadratic programme in which
rows that hold take no part until the step would break them. Source: Nocedal and Wright, Numerical Optimization (2006),
ch. 10.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import piqp

from lpc_mdo.optimization.certificate import violation
from lpc_mdo.optimization.evaluator import Evaluator

FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-2, 1e-10, 1e6
GOOD, POOR = 0.3, 0.01  # share of the predicted gain from which damping falls, below which it rises
STALLED = 15, 0.95  # steps, and the share of the violation left after them, that are no progress
STATIONARY = 1e-7  # predicted gain, relative to the violation's square, that is no gain


@dataclass(frozen=True)
class Restored:
    """x (n,) with its largest violation; `is_near`: that is as small as was asked."""

    x: np.ndarray
    violation: float
    is_near: bool


def restore(
    evaluator: Evaluator,
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
    missed = violation(evaluator.values(x)[1], *evaluator.limits)
    seen = list(past)
    while len(seen) < iterations:
        seen.append(float(np.abs(missed).max(initial=0.0)))
        if len(seen) > STALLED[0] and seen[-1] > STALLED[1] * seen[-1 - STALLED[0]]:
            break
        if seen[-1] <= tolerance or is_enough(x):
            break
        stepped = _step(evaluator, x, missed, damping)
        if stepped is None:
            break
        x, damping, missed = stepped
        report(x, damping)
    worst = float(np.abs(missed).max(initial=0.0))
    return Restored(x, worst, worst <= tolerance)


def _step(
    evaluator: Evaluator, x: np.ndarray, missed: np.ndarray, damping: float
) -> tuple[np.ndarray, float, np.ndarray] | None:
    """The next point (n,), the damping there and its violations (m,); None where no step lowers the violation."""
    _, values = evaluator.values(x)
    jacobian = evaluator.jacobian(x)
    if not np.isfinite(jacobian).all():
        return None
    before, is_raised = float(missed @ missed), False
    while damping <= LARGEST_DAMPING:
        step = _damped(evaluator, x, values, jacobian, damping)
        if step is None:
            return None
        predicted = before - _square(values + jacobian @ step, evaluator)
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


def _square(values: np.ndarray, evaluator: Evaluator) -> float:
    missed = violation(values, *evaluator.limits)
    return float(missed @ missed)


def _damped(
    evaluator: Evaluator, x: np.ndarray, values: np.ndarray, jacobian: np.ndarray, damping: float
) -> np.ndarray | None:
    """The step (n,) that minimizes |violation of the linear rows|^2 + damping |step|^2; None where the programme fails."""
    rows, count = jacobian.shape
    lower, upper = (limit - values for limit in evaluator.limits)
    is_equal = lower == upper
    matrix = np.hstack([jacobian, np.eye(rows)])
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
    free = np.full(rows, np.inf)
    solver.setup(
        np.diag(np.concatenate([np.full(count, damping), np.ones(rows)])),
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
