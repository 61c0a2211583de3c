"""Newton's method without matrices, for problems of many variables: conjugate gradients along the active rows.

Products of second derivatives with directions cost a gradient each; rows taken to hold with equality are kept by projection
(Nocedal and Wright, Numerical Optimization, 2006, alg. 7.2 and 16.2). Used once another method has found which rows and bounds
are active.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lpc_mdo.optimization.certificate import Certificate, certify, is_pressing
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.verdict import Fault, Remainder, gap_of, missing

ON_BOUND = 1e-9
PRODUCTS = 400  # with second derivatives for one step
RESIDUAL = 1e-9  # of the gradient, that conjugate gradients leave
SHORTENED = 12  # times that a step is halved
DOWNWARD = 1e-8  # curvature below minus this share of the largest seen is negative


@dataclass(frozen=True)
class LargeStep:
    """Newton's step (n,) with its multipliers (m,), what is left, and a direction (n,) that curves downward, if one was met."""

    step: np.ndarray
    multipliers: np.ndarray
    left: Remainder
    downward: np.ndarray | None


def newton_step(evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> LargeStep:
    """At x (n,) for scaled multipliers (m,)."""
    objective, values = evaluator.values(x)
    lower, upper = evaluator.limits
    jacobian = evaluator.jacobian(x)
    gradient = evaluator.gradient(x, np.zeros_like(values))
    pressure = gradient + jacobian.T @ multipliers
    held = ((x - evaluator.lower <= ON_BOUND) & (pressure > 0.0)) | (
        (evaluator.upper - x <= ON_BOUND) & (pressure < 0.0)
    )
    free = ~held
    active = np.flatnonzero((lower == upper) | is_pressing(multipliers, values, lower, upper))
    goal = np.where(multipliers > 0.0, upper, lower)[active] - values[active]
    across, size, right = np.linalg.svd(jacobian[active][:, free], full_matrices=False)
    rank = size > 1e-8 * size.max(initial=0.0)
    across, size, right = across[:, rank], size[rank], right[rank]
    normal = right.T @ ((across.T @ goal) / size)

    def project(v: np.ndarray) -> np.ndarray:
        return v - right.T @ (right @ v)

    def product(v: np.ndarray) -> np.ndarray:
        whole = np.zeros_like(x)
        whole[free] = v
        return evaluator.curvature_along(x, multipliers, whole)[free]

    bent = product(normal)
    tangent, downward = _conjugate(product, project, pressure[free] + bent)
    step = np.zeros_like(x)
    step[free] = normal + tangent
    slope = gradient + evaluator.curvature_along(x, multipliers, step)
    found = np.zeros_like(multipliers)
    found[active] = -across @ ((right @ slope[free]) / size)
    direction = None
    if downward is not None:
        direction = np.zeros_like(x)
        direction[free] = downward
    relative = np.abs(step) / np.maximum(1.0, np.abs(x))
    gain = abs(float(gradient @ step)) + 0.5 * abs(float(step @ (slope - gradient)))
    left = Remainder(float(relative.max(initial=0.0)), gain, gap_of(evaluator, x, multipliers), objective)
    return LargeStep(step, found, left, direction)


def _conjugate(
    product: Callable[[np.ndarray], np.ndarray], project: Callable[[np.ndarray], np.ndarray], slope: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None]:
    """The step that minimizes slope . p + p . H p/2 in the rows' null space, and a direction of negative curvature, if met."""
    step, residual = np.zeros_like(slope), project(slope)
    direction, square, stiffest = -residual, float(residual @ residual), 0.0
    enough = (RESIDUAL**2) * square
    for _ in range(PRODUCTS):
        if square <= enough or square == 0.0:
            break
        bent = project(product(direction))
        curvature, length = float(direction @ bent), float(direction @ direction)
        stiffest = max(stiffest, abs(curvature) / length)
        if curvature <= -DOWNWARD * stiffest * length:
            return (step if step.any() else -residual), direction / np.sqrt(length)
        if curvature <= 0.0:
            break
        share = square / curvature
        step, residual = step + share * direction, residual + share * bent
        new = float(residual @ residual)
        direction, square = -residual + new / square * direction, new
    return step, None


def refine_large(
    evaluator: Evaluator,
    x: np.ndarray,
    multipliers: np.ndarray,
    tolerances: tuple[float, float],
    iterations: int,
    report: Callable[[np.ndarray, np.ndarray, Certificate], None] = lambda x, multipliers, certificate: None,
) -> tuple[np.ndarray, np.ndarray]:
    """Newton steps from x (n,), shortened until the augmented Lagrangian falls, until the next one would be tiny."""
    for _ in range(iterations):
        ahead = newton_step(evaluator, x, multipliers)
        if certify(evaluator, x, multipliers).holds(*tolerances) and ahead.left.is_tiny(0.0, tolerances[0]):
            break
        before, moved = certify(evaluator, x, multipliers), None
        for share in 0.5 ** np.arange(SHORTENED):
            trial = np.clip(x + share * ahead.step, evaluator.lower, evaluator.upper)
            if not evaluator.is_finite(trial):
                continue
            blend = multipliers + share * (ahead.multipliers - multipliers)
            after = certify(evaluator, trial, blend)
            lower = evaluator.values(trial)[0] < evaluator.values(x)[0]
            is_descent = lower and after.feasibility <= max(before.feasibility, tolerances[1])
            if after.merit(*tolerances) < before.merit(*tolerances) or is_descent:
                moved = trial, blend, after
                break
        if moved is None:
            break
        x, multipliers = moved[:2]
        report(*moved)
    return x, multipliers


def fault_large(
    evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray, tolerances: tuple[float, float]
) -> Fault | None:
    """As `fault`, from one matrix-free step; negative curvature counts where conjugate gradients met it."""
    certificate = certify(evaluator, x, multipliers)
    if not certificate.holds(*tolerances):
        return missing(certificate, tolerances)
    ahead = newton_step(evaluator, x, multipliers)
    if ahead.downward is not None:
        return Fault("the point is stationary to the tolerance, but the objective curves downward beside it")
    if not ahead.left.is_settled(tolerances[0]):
        return ahead.left.unsettled()
    return None
