"""The last digits of an optimum: sequential quadratic programming with the Lagrangian's own second derivatives.

An augmented Lagrangian over L-BFGS comes near an optimum fast and then crawls; Newton's method for the optimality
conditions goes the rest in a few steps. Each step solves a convex quadratic programme (PIQP) for the variables that no bound
holds; a line search on the augmented Lagrangian keeps it from leaving. Source: Nocedal and Wright, Numerical Optimization
(2006), ch. 18.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import piqp

from lpc_mdo.optimization.certificate import Certificate, certify, violation
from lpc_mdo.optimization.evaluator import Evaluator

PRESSING = 1e-9  # scaled multiplier above which an inequality is taken to hold with equality
CONVEXIFICATION = 1e2  # curvature added across the active rows: it changes no step along them
PENALTY = 10.0  # of the augmented Lagrangian that steps must lower
LEAST_CURVATURE = 1e-5  # directions flatter than this are taken to curve so much
FIRST_RADIUS = 0.3  # largest change of a variable in the first step, relative to max(1, |x|)
SMALLEST_RADIUS, LARGEST_RADIUS = 1e-6, 2.0
HALVINGS = 6
QUADRATIC_TOLERANCE = 1e-9
ROUNDING = 1e-12
ON_BOUND = 1e-9


@dataclass(frozen=True)
class NewtonPoint:
    """An iterate: x (n,), scaled multipliers (m,) and their certificate."""

    x: np.ndarray
    multipliers: np.ndarray
    certificate: Certificate


def refine(
    evaluator: Evaluator,
    x: np.ndarray,
    multipliers: np.ndarray,
    stationarity_tolerance: float,
    feasibility_tolerance: float,
    iterations: int,
    report: Callable[[NewtonPoint], None] = lambda point: None,
) -> NewtonPoint:
    """Newton steps from (x, multipliers) until the certificate holds to the tolerances; the best point on the way."""
    tolerances = stationarity_tolerance, feasibility_tolerance
    best = point = NewtonPoint(x, multipliers, certify(evaluator, x, multipliers))
    radius = FIRST_RADIUS
    for _ in range(iterations):
        if point.certificate.holds(*tolerances):
            break
        try:
            model = _quadratic_model(evaluator, point)
        except ArithmeticError:  # the aircraft's model failed beside the point
            break
        stepped = _step(evaluator, point, model, radius)
        if stepped is None:
            break
        point, radius = stepped
        report(point)
        if point.certificate.merit(*tolerances) < best.certificate.merit(*tolerances):
            best = point
    return best


def _step(
    evaluator: Evaluator, point: NewtonPoint, model: "_QuadraticModel", radius: float
) -> tuple[NewtonPoint, float] | None:
    """The next point and the radius to try there; None where no radius gives a step that helps."""
    while SMALLEST_RADIUS <= radius <= LARGEST_RADIUS:
        proposal = model.minimize(radius)
        if proposal is None:  # the rows cannot be met so near
            radius *= 2.0
            continue
        step, asked = proposal
        share = _line_search(evaluator, point, step, asked, halvings=0)
        if share == 0.0 and (corrected := _corrected(evaluator, point, model, step, radius)) is not None:
            step = corrected
            share = _line_search(evaluator, point, step, asked, halvings=0)
        if share == 0.0:
            step = proposal[0]
            share = _line_search(evaluator, point, step, asked, halvings=HALVINGS)
        length = float((np.abs(step) / np.maximum(1.0, np.abs(point.x))).max(initial=0.0))
        if share == 0.0:
            radius = 0.1 * length
            continue
        x = np.clip(point.x + share * step, evaluator.lower, evaluator.upper)
        multipliers = point.multipliers + share * (asked - point.multipliers)
        if share < 1.0:
            radius = share * length
        elif length > 0.99 * radius:
            radius = min(2.0 * radius, LARGEST_RADIUS)
        return NewtonPoint(x, multipliers, certify(evaluator, x, multipliers)), radius
    return None


def _corrected(
    evaluator: Evaluator, point: NewtonPoint, model: "_QuadraticModel", step: np.ndarray, radius: float
) -> np.ndarray | None:
    """The step that allows for the rows' curvature, seen from their values at the step's end (second-order correction)."""
    trial = np.clip(point.x + step, evaluator.lower, evaluator.upper)
    if not evaluator.is_finite(trial):
        return None
    _, before = evaluator.values(point.x)
    _, after = evaluator.values(trial)
    bend = after - before - model.jacobian @ step[model.free]
    proposal = replace(model, row_lower=model.row_lower - bend, row_upper=model.row_upper - bend).minimize(1.5 * radius)
    return None if proposal is None else proposal[0]


@dataclass(frozen=True)
class _QuadraticModel:
    """Quadratic objective and linear rows at a point, for the variables that no bound holds."""

    hessian: np.ndarray  # (free, free), convex
    slope: np.ndarray  # (free,)
    jacobian: np.ndarray  # (m, free)
    row_lower: np.ndarray  # (m,)
    row_upper: np.ndarray
    free: np.ndarray  # indices
    reach: np.ndarray  # (free,) change of a variable at a radius of one
    room_below: np.ndarray  # (free,) to the bounds
    room_above: np.ndarray
    size: int

    def minimize(self, radius: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Step (n,) and multipliers (m,) within `radius`; None where the rows cannot be met."""
        equal, other = (
            np.flatnonzero(mask) for mask in (self.row_lower == self.row_upper, self.row_lower < self.row_upper)
        )
        solver = piqp.DenseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = QUADRATIC_TOLERANCE
        solver.setup(
            self.hessian,
            self.slope,
            self.jacobian[equal],
            self.row_lower[equal],
            self.jacobian[other],
            self.row_lower[other],
            self.row_upper[other],
            np.maximum(self.room_below, -radius * self.reach),
            np.minimum(self.room_above, radius * self.reach),
        )
        is_solved = solver.solve() == piqp.Status.PIQP_SOLVED
        left = max(solver.result.info.primal_res, solver.result.info.dual_res)
        if not (is_solved or left < 1e3 * QUADRATIC_TOLERANCE):
            return None
        step, multipliers = np.zeros(self.size), np.zeros(len(self.row_lower))
        step[self.free] = solver.result.x
        multipliers[equal] = solver.result.y
        multipliers[other] = solver.result.z_u - solver.result.z_l
        return step, multipliers


def _quadratic_model(evaluator: Evaluator, point: NewtonPoint) -> _QuadraticModel:
    """Raises ArithmeticError where a derivative is not finite."""
    x, multipliers = point.x, point.multipliers
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    jacobian = evaluator.jacobian(x)
    slope = evaluator.gradient(x, np.zeros_like(values))
    pressure = slope + jacobian.T @ multipliers
    is_held = ((x - evaluator.lower <= ON_BOUND) & (pressure > 0.0)) | (
        (evaluator.upper - x <= ON_BOUND) & (pressure < 0.0)
    )
    free = np.flatnonzero(~is_held)
    active = np.flatnonzero((lower == upper) | (np.abs(multipliers) > PRESSING))
    target = np.where(multipliers > 0.0, upper, lower)
    across = jacobian[np.ix_(active, free)]
    hessian = evaluator.hessian(x, multipliers)[np.ix_(free, free)] + CONVEXIFICATION * across.T @ across
    if not np.isfinite(hessian).all():
        raise FloatingPointError("second derivatives are not finite")
    curvature, axes = np.linalg.eigh(hessian)
    return _QuadraticModel(
        hessian=(axes * np.maximum(np.abs(curvature), LEAST_CURVATURE)) @ axes.T,
        slope=slope[free] + CONVEXIFICATION * across.T @ (values - target)[active],
        jacobian=jacobian[:, free],
        row_lower=lower - values,
        row_upper=np.where(lower == upper, lower - values, upper - values),
        free=free,
        reach=np.maximum(1.0, np.abs(x))[free],
        room_below=(evaluator.lower - x)[free],
        room_above=(evaluator.upper - x)[free],
        size=len(x),
    )


def _line_search(
    evaluator: Evaluator, point: NewtonPoint, step: np.ndarray, multipliers: np.ndarray, halvings: int
) -> float:
    """Largest of 1, 1/2, 1/4 ... that lowers the augmented Lagrangian for `multipliers`; 0 if none does."""
    before = _augmented(evaluator, point.x, multipliers)
    for share in 0.5 ** np.arange(halvings + 1):
        trial = np.clip(point.x + share * step, evaluator.lower, evaluator.upper)
        # Near the optimum the fall is lost in rounding: a change within it is no rise.
        if evaluator.is_finite(trial) and _augmented(evaluator, trial, multipliers) <= before + ROUNDING * (
            1 + abs(before)
        ):
            return float(share)
    return 0.0


def _augmented(evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> float:
    objective, values = evaluator.values(x)
    residual = violation(values + multipliers / PENALTY, *evaluator.limits)
    return objective + 0.5 * PENALTY * float(residual @ residual)
