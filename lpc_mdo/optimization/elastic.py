"""The least violation as a problem of its own: elastic mode.

Minimize t with every scaled row within t of its limits, by the Newton's method that looks for optima. Unlike a least sum of
squares this follows the curved valley between rows that fight each other, and its certificate is that of the least violation: a
design that no small change brings nearer to the limits. Source: Gill, Murray, Saunders, SIAM Rev. 47 (2005), sec. 4.3.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lpc_mdo.optimization.certificate import LARGE, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.evaluator import Counts, Evaluator
from lpc_mdo.optimization.newton import ACTIVE, NewtonPoint, refine, start_point

STATIONARY = 1e-3  # of the least violation: what its conditions may lack, since t alone has a slope of one
STEPS = 60


class Elastic:
    """The elastic problem of z = (x, t), as solvers ask an Evaluator: each row once with its lower, once with its upper limit."""

    def __init__(self, evaluator: Evaluator) -> None:
        self.inner = evaluator
        lower, upper = evaluator.limits
        self.below, self.above = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self.lower, self.upper = np.append(evaluator.lower, 0.0), np.append(evaluator.upper, np.inf)
        nothing = np.full(len(self.below), np.inf), np.full(len(self.above), -np.inf)
        self.limits = np.append(lower[self.below], nothing[1]), np.append(nothing[0], upper[self.above])
        self.slope = np.append(np.ones(len(self.below)), -np.ones(len(self.above)))  # of the rows in t

    @property
    def counts(self) -> Counts:
        return self.inner.counts

    @property
    def curvature_noise(self) -> float:
        return self.inner.curvature_noise

    def is_finite(self, z: np.ndarray) -> bool:
        return self.inner.is_finite(z[:-1])

    def values(self, z: np.ndarray) -> tuple[float, np.ndarray]:
        _, values = self.inner.values(z[:-1])
        return float(z[-1]), self._both(values) + self.slope * z[-1]

    def gradient(self, z: np.ndarray, weights: np.ndarray, objective_weight: float = 1.0) -> np.ndarray:
        slope = self.inner.gradient(z[:-1], self._of_rows(weights), 0.0)
        return np.append(slope, objective_weight + float(self.slope @ weights))

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        return np.hstack([self._both(self.inner.jacobian(z[:-1])), self.slope[:, None]])

    def hessian(self, z: np.ndarray, multipliers: np.ndarray, objective_weight: float = 1.0) -> np.ndarray:
        hessian = np.zeros((len(z), len(z)))
        hessian[:-1, :-1] = self.inner.hessian(z[:-1], self._of_rows(multipliers), 0.0)
        return hessian

    def _both(self, values: np.ndarray) -> np.ndarray:
        return np.concatenate([values[self.below], values[self.above]])

    def _of_rows(self, weights: np.ndarray) -> np.ndarray:
        """Weights (m,) of the rows from those of both their copies."""
        found = np.zeros(len(self.inner.constraint_lower))
        found[self.below] += weights[: len(self.below)]
        found[self.above] += weights[len(self.below) :]
        return found


@dataclass(frozen=True)
class LeastViolation:
    """x (n,) with its largest violation; slope: the share of it that a unit change of a variable would take away."""

    x: np.ndarray
    violation: float
    slope: float


class _Enough(Exception):
    """The violation is as small as was asked."""


def least_violation(
    evaluator: Evaluator,
    x: np.ndarray,
    tolerance: float,
    report: Callable[[np.ndarray], None] = lambda x: None,
    steps: int = STEPS,
) -> LeastViolation:
    """From x (n,) to a largest violation of at most `tolerance`, or to the least one beside it; `report` is told every point.

    Raises ValueError for more than LARGE variables: it needs matrices.
    """
    if len(x) > LARGE:
        raise ValueError(f"{len(x)} variables are too many: there must be at most {LARGE}")
    elastic = Elastic(evaluator)
    newest = [x]

    def worst(x: np.ndarray) -> float:
        return float(np.abs(violation(evaluator.values(x)[1], *evaluator.limits)).max(initial=0.0))

    def watch(point: NewtonPoint) -> None:
        newest[0] = point.x[:-1]
        report(newest[0])
        if worst(newest[0]) <= tolerance:
            raise _Enough

    z = np.append(x, worst(x))
    multipliers = least_squares_multipliers(elastic, z, ACTIVE)
    try:
        point = refine(elastic, start_point(elastic, z, multipliers), STATIONARY, tolerance, steps, watch).point
    except _Enough:
        return LeastViolation(newest[0], worst(newest[0]), np.inf)
    best = point.x[:-1]
    slope = certify(elastic, np.append(best, point.x[-1]), point.multipliers).optimality
    return LeastViolation(best, worst(best), slope)
