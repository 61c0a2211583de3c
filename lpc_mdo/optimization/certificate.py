"""How far a point is from satisfying the optimality conditions, and the multipliers that show it best."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from lpc_mdo.optimization.functions import Functions

PRESSING = 1e-9  # scaled multiplier above which an inequality is taken to hold with equality
NEAR = 1e-2  # unless its scaled slack is above this
LARGE = 300  # variables beyond which no matrix of their number squared is formed
ON_BOUND = 1e-6  # distance below which a bound may take up a gradient: the projected step is then no longer than this


@dataclass(frozen=True)
class Certificate:
    """Scaled infinity norms.

    stationarity: |x - P(x - grad L)| with P the projection on the bounds and L = s_f f + lambda . s_c c; feasibility: the
    largest violation; complementarity: over inequality rows the largest of min(|lambda|, slack) and |lambda| slack, which
    is what the slack may be worth.
    """

    stationarity: float
    feasibility: float
    complementarity: float
    worst_variable: int
    worst_constraint: int

    def holds(self, stationarity_tolerance: float, feasibility_tolerance: float) -> bool:
        return (
            self.stationarity <= stationarity_tolerance
            and self.feasibility <= feasibility_tolerance
            and self.complementarity <= stationarity_tolerance
        )

    @property
    def optimality(self) -> float:
        """How far the multipliers are from fitting the point."""
        return max(self.stationarity, self.complementarity)

    def merit(self, stationarity_tolerance: float, feasibility_tolerance: float) -> float:
        """One number to compare points by: at most 1 where the certificate holds."""
        return max(
            self.stationarity / stationarity_tolerance,
            self.feasibility / feasibility_tolerance,
            self.complementarity / stationarity_tolerance,
        )


def violation(values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Signed distance (m,) beyond the limits: negative below the lower, positive above the upper one."""
    return np.minimum(values - lower, 0.0) + np.maximum(values - upper, 0.0)


def certify(evaluator: Functions, x: np.ndarray, multipliers: np.ndarray) -> Certificate:
    """Certificate at x for the given scaled multipliers: positive ones press on the upper limit, negative on the lower."""
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    gradient = evaluator.gradient(x, multipliers)
    step = np.abs(x - np.clip(x - gradient, evaluator.lower, evaluator.upper))
    beyond = np.abs(violation(values, lower, upper))
    slack = np.where(multipliers > 0.0, upper - values, values - lower)
    size, slack = np.abs(multipliers), np.where(multipliers == 0.0, 0.0, np.maximum(slack, 0.0))
    product = np.where(lower < upper, np.maximum(np.minimum(size, slack), size * slack), 0.0)
    return Certificate(
        stationarity=float(step.max(initial=0.0)),
        feasibility=float(beyond.max(initial=0.0)),
        complementarity=float(product.max(initial=0.0)),
        worst_variable=int(step.argmax()) if len(step) else -1,
        worst_constraint=int(beyond.argmax()) if len(beyond) else -1,
    )


def is_pressing(multipliers: np.ndarray, values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Mask (m,) of rows whose multipliers press on a limit that is reached or near."""
    slack = np.where(multipliers > 0.0, upper - values, values - lower)
    return (np.abs(multipliers) > PRESSING) & (slack <= NEAR)


def least_squares_multipliers(
    evaluator: Functions, x: np.ndarray, active_tolerance: float, pressing: np.ndarray | None = None
) -> np.ndarray:
    """Scaled multipliers (m,) of the active rows that leave the smallest Lagrangian gradient off the active bounds.

    Active are rows within the tolerance of a limit or beyond it, and those that press with multipliers `pressing` (m,).
    """
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    gradient = evaluator.gradient(x, np.zeros_like(values))
    jacobian = evaluator.jacobian(x)
    at_lower, at_upper = values - lower <= active_tolerance, upper - values <= active_tolerance
    if pressing is not None:
        is_active = is_pressing(pressing, values, lower, upper)
        at_lower, at_upper = at_lower | (is_active & (pressing < 0.0)), at_upper | (is_active & (pressing > 0.0))
    active = np.flatnonzero(at_lower | at_upper)
    multipliers = np.zeros_like(values)
    if len(active) == 0:
        return multipliers
    if len(x) > LARGE:  # the variables off their bounds decide
        free = (x - evaluator.lower > ON_BOUND) & (evaluator.upper - x > ON_BOUND)
        found = np.linalg.lstsq(jacobian[np.ix_(active, free)].T, -gradient[free], rcond=None)[0]
        low, high = np.where(at_lower[active], -np.inf, 0.0), np.where(at_upper[active], np.inf, 0.0)
        multipliers[active] = np.clip(found, low, high)
        return multipliers
    # A bound's multiplier absorbs a gradient that presses against it: one column with a sign for each active bound.
    on_lower = np.flatnonzero(x - evaluator.lower <= ON_BOUND)
    on_upper = np.flatnonzero(evaluator.upper - x <= ON_BOUND)
    identity = np.eye(len(x))
    columns = np.hstack([jacobian[active].T, -identity[:, on_lower], identity[:, on_upper]])
    smallest = np.where(at_lower[active], -np.inf, 0.0)
    largest = np.where(at_upper[active], np.inf, 0.0)
    bounds = (
        np.concatenate([smallest, np.zeros(len(on_lower) + len(on_upper))]),
        np.concatenate([largest, np.full(len(on_lower) + len(on_upper), np.inf)]),
    )
    solution = lsq_linear(columns, -gradient, bounds, tol=1e-14, max_iter=500)
    multipliers[active] = solution.x[: len(active)]
    return multipliers
