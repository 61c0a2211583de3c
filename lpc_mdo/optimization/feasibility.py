"""Whether there is a feasible design at all: elastic mode from where a search stands and from other starts, and the verdict."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from lpc_mdo.optimization.certificate import LARGE, violation
from lpc_mdo.optimization.elastic import QUICK, STEADY, STUBBORN, Effort, LeastViolation, least_violation
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.restoration import restore

STARTS, SEED = 3, 0  # beside the one from where the search stands
APPROACH, MOST = 10, 100  # steps of restoration from another start, and where elastic mode cannot follow
NO_SLOPE = 1e-3  # relative slope of the violation that counts as none

Report = Callable[[np.ndarray], None]
"""Told every point (n,)."""


def nearest_feasible(
    evaluator: Evaluator, x: np.ndarray, tolerance: float, report: Report = lambda x: None
) -> LeastViolation:
    """From x (n,) or, where that ends above the tolerance, from STARTS other points within the bounds, the same ones every
    time: the best end.
    """
    best = _lowest(evaluator, x, tolerance, STEADY, report)
    draw = np.random.default_rng(SEED)
    for number in range(STARTS):
        if best.violation <= tolerance:
            break
        reach = 2.0**number * np.maximum(1.0, np.abs(x))
        low, high = np.maximum(evaluator.lower, x - reach), np.minimum(evaluator.upper, x + reach)
        start = draw.uniform(low, high)
        if evaluator.is_finite(start):
            if len(x) <= LARGE:
                start = restore(evaluator, start, tolerance, iterations=APPROACH).x
            other = _lowest(evaluator, start, tolerance, QUICK, report)
            best = other if other.violation < best.violation else best
    if best.violation > tolerance and best.slope > NO_SLOPE:  # its search was given up before the verdict was clear
        last = _lowest(evaluator, best.x, tolerance, STUBBORN, report)
        best = last if last.violation <= best.violation else best
    return best


def _lowest(evaluator: Evaluator, x: np.ndarray, tolerance: float, effort: Effort, report: Report) -> LeastViolation:
    """The least violation near x (n,)."""
    if len(x) <= LARGE:
        found = least_violation(evaluator, x, tolerance, report, effort)
    else:
        restored = restore(evaluator, x, tolerance, iterations=MOST)
        found = LeastViolation(restored.x, restored.violation, np.inf)
    slope = stationarity(evaluator, found.x)
    return LeastViolation(found.x, found.violation, min(slope, found.slope))


def infeasibility(
    evaluator: Evaluator, x: np.ndarray, tolerance: float
) -> tuple[Literal["infeasible", "failed"], str] | None:
    """Status and words where no feasible point is found from x (n,) and other starts; None where one is."""
    found = nearest_feasible(evaluator, x, tolerance)
    return None if found.violation <= tolerance else lack_of_feasible(found)


def lack_of_feasible(found: LeastViolation) -> tuple[Literal["infeasible", "failed"], str]:
    """Status and words for the best end of a search that found no feasible point."""
    words = f"no feasible design found from {STARTS + 1} starts; least violation {found.violation:.3g} (scaled)"
    if found.slope <= NO_SLOPE:
        return "infeasible", f"{words}, which no small change lowers (relative slope {found.slope:.1g})"
    return "failed", f"{words}, where it still falls (relative slope {found.slope:.1g})"


def stationarity(evaluator: Evaluator, x: np.ndarray) -> float:
    """Share of the sum of squared violations at x (n,) that a unit change of a variable would take away, to first order."""
    missed = violation(evaluator.values(x)[1], *evaluator.limits)
    slope = 2.0 * evaluator.jacobian(x).T @ missed / max(float(missed @ missed), 1e-300)
    return float(np.abs(x - np.clip(x - slope, evaluator.lower, evaluator.upper)).max(initial=0.0))
