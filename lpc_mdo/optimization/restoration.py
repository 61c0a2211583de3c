"""From a nearly optimal point to a feasible one close by: the last digits of an optimum cost a few Jacobians.

Near a solution the augmented Lagrangian's multipliers are right long before its violation is small. The nearest point of
the linearized active rows then changes the Lagrangian's gradient only by its curvature times the tiny step.
"""

import numpy as np
import piqp

from lpc_mdo.optimization.certificate import Certificate, certify
from lpc_mdo.optimization.evaluator import Evaluator

PRESSING = 1e-9  # scaled multiplier above which a row is held at its limit


def restore_feasibility(
    evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray, feasibility_tolerance: float, iterations: int = 4
) -> tuple[np.ndarray, Certificate]:
    """Newton's method for the active rows, each step the shortest within the bounds."""
    certificate = certify(evaluator, x, multipliers)
    for _ in range(iterations):
        if certificate.feasibility <= feasibility_tolerance:
            break
        trial = np.clip(x + _shortest_step(evaluator, x, multipliers), evaluator.lower, evaluator.upper)
        if not evaluator.is_finite(trial):
            break
        new = certify(evaluator, trial, multipliers)
        if new.feasibility >= max(certificate.feasibility, feasibility_tolerance):
            break
        x, certificate = trial, new
    return x, certificate


def _shortest_step(evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """Shortest d (n,) within the bounds that meets the linearized rows, those that press on a limit exactly.

    Variables that the projected gradient of the Lagrangian would carry onto a bound are put there first.
    """
    _, values = evaluator.values(x)
    jacobian = evaluator.jacobian(x)
    downhill = x - evaluator.gradient(x, multipliers)
    is_bound = (downhill <= evaluator.lower) | (downhill >= evaluator.upper)
    step = np.where(is_bound, np.clip(downhill, evaluator.lower, evaluator.upper) - x, 0.0)
    lower, upper = evaluator.limits
    values = values + jacobian @ step
    low = np.where(multipliers > PRESSING, upper, lower) - values
    high = np.where(multipliers < -PRESSING, lower, upper) - values
    equal, other, free = np.flatnonzero(low == high), np.flatnonzero(low < high), np.flatnonzero(~is_bound)
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-13
    solver.setup(
        np.eye(len(free)),
        np.zeros(len(free)),
        jacobian[np.ix_(equal, free)],
        low[equal],
        jacobian[np.ix_(other, free)],
        low[other],
        high[other],
        (evaluator.lower - x)[free],
        (evaluator.upper - x)[free],
    )
    solver.solve()
    step[free] = solver.result.x
    return step
