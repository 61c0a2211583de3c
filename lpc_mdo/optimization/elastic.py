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

CERTIFIED = 1e-4  # share of the violation that a unit change of a variable may take away from a least one
FINEST = 1e-10  # tolerance that Newton's method is never asked to reach


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
class Effort:
    """Newton steps at most, and when to give up: after so many in a row that leave more than this share of the violation."""

    steps: int
    patience: int
    share: float


QUICK, STEADY, STUBBORN = Effort(20, 5, 0.85), Effort(60, 5, 0.98), Effort(60, 20, 0.9999)


@dataclass(frozen=True)
class LeastViolation:
    """x (n,) with its largest violation; slope: the share of it that a unit change of a variable would take away."""

    x: np.ndarray
    violation: float
    slope: float


class _Enough(Exception):
    """There is no more to gain."""


class _Watch:
    """Keeps the best point on the way, and says when to stop."""

    def __init__(self, elastic: Elastic, x: np.ndarray, tolerance: float, effort: Effort) -> None:
        self.elastic, self.tolerance, self.effort = elastic, tolerance, effort
        self.found = LeastViolation(x, self.worst(x), np.inf)
        self.seen = [self.found.violation]

    def worst(self, x: np.ndarray) -> float:
        evaluator = self.elastic.inner
        return float(np.abs(violation(evaluator.values(x)[1], *evaluator.limits)).max(initial=0.0))

    def see(self, point: NewtonPoint) -> None:
        """Raises _Enough where the violation is small enough, certified as the least one, or has stopped to fall."""
        x = point.x[:-1]
        missed = self.worst(x)
        self.seen.append(missed)
        if missed <= self.found.violation:
            left = certify(self.elastic, np.append(x, missed), point.multipliers)
            self.found = LeastViolation(x, missed, max(left.optimality, left.feasibility) / max(missed, 1e-300))
        is_certified = missed <= self.found.violation and self.found.slope <= CERTIFIED
        last = self.effort.patience
        is_stalled = len(self.seen) > last and min(self.seen[-last:]) > self.effort.share * min(self.seen[:-last])
        if missed <= self.tolerance or is_certified or is_stalled:
            raise _Enough


def least_violation(
    evaluator: Evaluator,
    x: np.ndarray,
    tolerance: float,
    report: Callable[[np.ndarray], None] = lambda x: None,
    effort: Effort = STEADY,
) -> LeastViolation:
    """From x (n,) to a largest violation of at most `tolerance`, or to the least one beside it; `report` is told every point.

    Raises ValueError for more than LARGE variables: it needs matrices.
    """
    if len(x) > LARGE:
        raise ValueError(f"{len(x)} variables are too many: there must be at most {LARGE}")
    elastic = Elastic(evaluator)
    watch = _Watch(elastic, x, tolerance, effort)
    z = np.append(x, watch.found.violation)
    start = start_point(elastic, z, least_squares_multipliers(elastic, z, ACTIVE))

    def see(point: NewtonPoint) -> None:
        report(point.x[:-1])
        watch.see(point)

    try:
        watch.see(start)
        refine(elastic, start, FINEST, FINEST, effort.steps, see)
    except _Enough:
        pass
    return watch.found
