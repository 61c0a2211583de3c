"""Leaving points that are stationary but no minimum: maxima, saddles, and inflections where nothing curves.

Along the directions of least curvature the objective is tried at steps of several lengths to both sides; where rows are active,
each trial is brought back to them first.
"""

import numpy as np

from lpc_mdo.optimization.certificate import violation
from lpc_mdo.optimization.functions import Functions
from lpc_mdo.optimization.quadratic import RANK, QuadraticModel
from lpc_mdo.optimization.restoration import restore
from lpc_mdo.optimization.verdict import DOWNWARD, least_curvature

LENGTHS = (1.0, 1e-1, 1e-2, 1e-3, 1e-4)
DIRECTIONS = 3  # of least curvature
SETTLED = 1e-9  # objective, relative, that a trial must gain
REACHED = 1e-6  # distance from a bound or a limit, scaled
CORRECTIONS = 8  # steps back to the rows


def lower_point(
    evaluator: Functions, x: np.ndarray, multipliers: np.ndarray, model: QuadraticModel, tolerance: float
) -> np.ndarray | None:
    """A point (n,) beside x that is better by more than its violations, of at most the tolerance, are worth; None if none is.

    Directions that curve downward are tried; flat ones and the flattest, too, where no row must be met again: that costs
    little, and shows inflections.
    """
    limit = -DOWNWARD if len(model.active) else DOWNWARD
    is_tried = model.curvature[:DIRECTIONS] <= limit * model.stiffness
    is_tried[:1] |= len(model.active) == 0
    tried = np.flatnonzero(is_tried)
    here = evaluator.values(x)[0]
    best, lowest = None, here - SETTLED * abs(here) - 1e-300
    for index in tried:
        direction = np.zeros_like(x)
        direction[model.free] = model.axes[:, index]
        for side in (1.0, -1.0):
            for length in LENGTHS:
                trial = _trial(evaluator, x, side * length * direction, model, tolerance)
                if trial is not None and (value := _worth(evaluator, trial, multipliers)) < lowest:
                    best, lowest = trial, value
    evaluator.values(x)
    return best


def _worth(evaluator: Functions, x: np.ndarray, multipliers: np.ndarray) -> float:
    """The objective, and violations at the price of the multipliers (m,)."""
    objective, values = evaluator.values(x)
    return objective + float(np.abs(multipliers * violation(values, *evaluator.limits)).sum())


def _trial(
    evaluator: Functions, x: np.ndarray, step: np.ndarray, model: QuadraticModel, tolerance: float
) -> np.ndarray | None:
    trial = np.clip(x + step * np.maximum(1.0, np.abs(x)), evaluator.lower, evaluator.upper)
    trial = _on_rows(evaluator, x, trial, model, tolerance)
    if trial is None:
        return None
    missed = np.abs(violation(evaluator.values(trial)[1], *evaluator.limits)).max(initial=0.0)
    if missed > tolerance:
        restored = restore(evaluator, trial, tolerance, iterations=CORRECTIONS)
        return restored.x if restored.is_near else None
    return trial


def _on_rows(
    evaluator: Functions, x: np.ndarray, trial: np.ndarray, model: QuadraticModel, tolerance: float
) -> np.ndarray | None:
    """The trial (n,) brought to the values that the active rows have at x; None where values are not finite.

    Beside a row that curves away a step along it leads off the row without violating it, and gains nothing there.
    """
    if not evaluator.is_finite(trial):
        return None
    if not len(model.active):
        return trial
    wanted = evaluator.values(x)[1][model.active]
    for _ in range(CORRECTIONS):
        if not evaluator.is_finite(trial):
            return None
        gap = evaluator.values(trial)[1][model.active] - wanted
        if np.abs(gap).max() <= tolerance:
            break
        slopes = evaluator.jacobian(trial)[model.active][:, model.free]
        back = np.zeros_like(trial)
        back[model.free] = np.linalg.lstsq(slopes, gap, rcond=None)[0]
        trial = np.clip(trial - back, evaluator.lower, evaluator.upper)
    return trial if evaluator.is_finite(trial) else None


def curves_downward(evaluator: Functions, x: np.ndarray, model: QuadraticModel) -> bool:
    """Whether the Lagrangian curves downward at x (n,) where all bounds and rows that are reached are kept.

    Those that do not press may be left to one side only, which `lower_point` has tried.
    """
    if least_curvature(model) >= -DOWNWARD:
        return False
    values, (lower, upper) = evaluator.values(x)[1], evaluator.limits
    reached = np.minimum(values - lower, upper - values) <= REACHED
    inner = np.minimum(x - evaluator.lower, evaluator.upper - x)[model.free] > REACHED
    if not inner.any():
        return False
    _, size, right = np.linalg.svd(model.jacobian[reached][:, inner], full_matrices=True)
    along = right[int((size > RANK * size.max(initial=0.0)).sum()) :].T
    curvature = np.linalg.eigvalsh(along.T @ model.hessian[np.ix_(inner, inner)] @ along)
    least = float(curvature.min(initial=0.0))
    # Of a linear objective the second derivatives are rounding: what they could gain over a step of the point's own size is nothing.
    gain = 0.5 * abs(least) * max(1.0, float(np.abs(x).max())) ** 2
    return least < -DOWNWARD * model.stiffness and gain > SETTLED * abs(evaluator.values(x)[0])
