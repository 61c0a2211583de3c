"""Sequential quadratic programming with the exact Hessian of the Lagrangian: the last digits of an optimum.

The Hessian comes from central differences of the exact gradient, which implicit solves in the model allow everywhere; it is
made convex by adding the curvature of the active rows (a change that leaves their subproblem's solution alone) and, if
that does not suffice, by lifting its eigenvalues.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import LinearConstraint, minimize

from lpc_mdo.optimization.certificate import Certificate, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.evaluator import Evaluator

DIFFERENCE_STEP = 1e-5  # of variables that are O(1); the gradient is exact to 1e-12
SMALLEST_CURVATURE = 1e-4


def lagrangian_hessian(evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """Symmetric (n, n)."""
    rows = []
    for i in range(len(x)):
        step = np.zeros_like(x)
        step[i] = DIFFERENCE_STEP
        ahead = evaluator.gradient(x + step, multipliers)
        behind = evaluator.gradient(x - step, multipliers)
        rows.append((ahead - behind) / (2.0 * DIFFERENCE_STEP))
    hessian = np.array(rows)
    return 0.5 * (hessian + hessian.T)


def _convex(hessian: np.ndarray, active: np.ndarray, free: np.ndarray) -> np.ndarray:
    """hessian + rho A^T A, positive definite on the free variables; lifted eigenvalues where no rho suffices."""
    penalty = active.T @ active
    size = 1.0 + np.abs(hessian).max()
    for rho in (0.0, 1.0, 10.0, 100.0, 1000.0):
        candidate = hessian + rho * size * penalty
        if free.any() and np.linalg.eigvalsh(candidate[np.ix_(free, free)])[0] < SMALLEST_CURVATURE:
            continue
        pinned = ~free
        candidate[np.ix_(pinned, pinned)] += np.eye(pinned.sum()) * size
        if np.linalg.eigvalsh(candidate)[0] > 0.0:
            return candidate
    values, vectors = np.linalg.eigh(hessian + 10.0 * size * penalty)
    return (vectors * np.maximum(np.abs(values), SMALLEST_CURVATURE * size)) @ vectors.T


def _quadratic_step(
    evaluator: Evaluator, x: np.ndarray, hessian: np.ndarray, gradient: np.ndarray, jacobian: np.ndarray, radius: float
) -> np.ndarray:
    """Minimizer d (n,) of the quadratic model within bounds, linearized rows and |d| <= radius."""
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    box = np.maximum(evaluator.lower - x, -radius), np.minimum(evaluator.upper - x, radius)
    # Rows that the box does not let reach their limit are only asked to come as near as they can.
    reach = np.maximum(jacobian, 0) @ box[1] + np.minimum(jacobian, 0) @ box[0]
    fall = np.maximum(jacobian, 0) @ box[0] + np.minimum(jacobian, 0) @ box[1]
    low = np.minimum(lower - values, 0.9 * reach)
    high = np.maximum(upper - values, 0.9 * fall)
    solution = minimize(
        lambda d: 0.5 * d @ hessian @ d + gradient @ d,
        np.zeros_like(x),
        jac=lambda d: hessian @ d + gradient,
        bounds=list(zip(*box, strict=True)),
        constraints=[
            LinearConstraint(jacobian[rows], low[rows], high[rows])
            for rows in (np.flatnonzero(low == high), np.flatnonzero(low < high))
            if len(rows)
        ],
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-16},
    )
    return np.clip(solution.x, *box)


def polish(
    evaluator: Evaluator,
    x: np.ndarray,
    multipliers: np.ndarray,
    stationarity_tolerance: float,
    feasibility_tolerance: float,
    iterations: int,
    report: Callable[[np.ndarray, np.ndarray, Certificate], None],
) -> tuple[np.ndarray, np.ndarray, Certificate]:
    """Improve x until the certificate holds, or no step improves it."""
    certificate = certify(evaluator, x, multipliers)
    radius = 0.3
    for _ in range(iterations):
        if certificate.holds(stationarity_tolerance, feasibility_tolerance):
            break
        lower, upper = evaluator.limits
        _, values = evaluator.values(x)
        jacobian = evaluator.jacobian(x)
        gradient = evaluator.gradient(x, np.zeros_like(values))
        near = (values - lower <= 1e-3) | (upper - values <= 1e-3)
        free = (x - evaluator.lower > 1e-9) & (evaluator.upper - x > 1e-9)
        hessian = _convex(lagrangian_hessian(evaluator, x, multipliers), jacobian[near], free)
        has_improved = False
        for _ in range(8):
            step = _quadratic_step(evaluator, x, hessian, gradient, jacobian, radius)
            trial = np.clip(x + step, evaluator.lower, evaluator.upper)
            if evaluator.is_finite(trial):
                trial_multipliers = least_squares_multipliers(evaluator, trial, active_tolerance=1e-5)
                new = certify(evaluator, trial, trial_multipliers)
                if _is_better(
                    evaluator, x, trial, multipliers, certificate, new, stationarity_tolerance, feasibility_tolerance
                ):
                    x, multipliers, certificate, has_improved = trial, trial_multipliers, new, True
                    radius = min(2.0 * radius, 1.0)
                    break
            radius = 0.25 * min(radius, float(np.abs(step).max(initial=0.0)) or radius)
        report(x, multipliers, certificate)
        if not has_improved:
            break
    return x, multipliers, certificate


def _is_better(
    evaluator: Evaluator,
    x: np.ndarray,
    trial: np.ndarray,
    multipliers: np.ndarray,
    old: Certificate,
    new: Certificate,
    stationarity_tolerance: float,
    feasibility_tolerance: float,
) -> bool:
    """Accept a better certificate, or a lower exact penalty function (l1, weights above the multipliers)."""
    if new.merit(stationarity_tolerance, feasibility_tolerance) < old.merit(
        stationarity_tolerance, feasibility_tolerance
    ):
        return True
    weight = 2.0 * np.abs(multipliers) + 1.0
    lower, upper = evaluator.limits

    def penalty(point: np.ndarray) -> float:
        objective, values = evaluator.values(point)
        return objective + float(weight @ np.abs(violation(values, lower, upper)))

    return penalty(trial) < penalty(x) - 1e-10
