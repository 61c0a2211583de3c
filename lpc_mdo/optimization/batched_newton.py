"""Newton's method for many optimality conditions at once: second derivatives of all problems from shared batches.

Sequential quadratic programming as in `newton`. The Lagrangian's second derivatives are exact when a problem joins and
whenever its steps stop helping; in between, every step improves them by what its gradients show (symmetric rank one).
Source: Nocedal and Wright, Numerical Optimization (2006), ch. 6 and 18.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import piqp
import torch
from torch import Tensor

from lpc_mdo.optimization.batched_functions import BatchedFunctions, Derivatives
from lpc_mdo.optimization.certificate import Certificate

Report = Callable[[int, float, Certificate], None]

CONVEXIFICATION = 1e2  # curvature added across the active rows: it changes no step along them
PENALTY = 10.0  # of the augmented Lagrangian that steps must lower
LEAST_CURVATURE = 1e-5  # directions flatter than this are taken to curve so much
PRESSING = 1e-9  # scaled multiplier above which an inequality is taken to hold with equality
FIRST_RADIUS, SMALLEST_RADIUS, LARGEST_RADIUS = 0.3, 1e-6, 2.0  # relative to max(1, |x|)
HALVINGS = 6
QUADRATIC_TOLERANCE = 1e-9
ROUNDING = 1e-12
ON_BOUND = 1e-9
SAFE_UPDATE = 1e-8  # of |r| |s|: smaller denominators are left out of the rank-one update
HELPFUL = 0.5  # a step that leaves more of the certificate's merit than this does not help
PATIENCE = 3  # steps in a row that do not help, before second derivatives are exact again


@dataclass
class _Problem:
    """One problem's own state."""

    which: int
    x: Tensor  # (n,)
    multipliers: Tensor  # (m,)
    at: Derivatives  # (1, ...)
    certificate: Certificate
    radius: float = FIRST_RADIUS
    hessian: Tensor | None = None  # (n, n); None: to be computed
    unhelpful: int = 0
    step: Tensor = field(default_factory=lambda: torch.zeros(0))  # proposed, with
    asked: Tensor = field(default_factory=lambda: torch.zeros(0))  # these multipliers
    is_going: bool = True


def refine_batch(
    functions: BatchedFunctions,
    x: Tensor,
    multipliers: Tensor,
    which: Tensor,
    tolerances: tuple[float, float],
    iterations: int,
    report: Report = lambda which, objective, certificate: None,
) -> tuple[Tensor, Tensor, list[Certificate]]:
    """Newton steps from x (b, n) and multipliers (b, m) of problems `which` (b,) until each certificate holds.

    tolerances: of stationarity and feasibility; report: told problem, scaled objective and certificate of every step. Returns the best x, multipliers and certificate of each on the way.
    """
    at = functions.derivatives(x, which)
    certificates = functions.certificates(x, which, multipliers, at)
    problems = [_Problem(int(which[i]), x[i], multipliers[i], _one(at, i), certificates[i]) for i in range(len(x))]
    best = [(p.x, p.multipliers, p.certificate) for p in problems]
    for _ in range(iterations):
        going = [p for p in problems if p.is_going and not p.certificate.holds(*tolerances)]
        if not going:
            break
        _renew(functions, [p for p in going if p.hessian is None])
        moved = _search(functions, [p for p in going if _propose(functions, p)])
        _arrive(functions, moved, tolerances)
        for p, _ in moved:
            report(p.which, float(p.at.objective), p.certificate)
        for i, p in enumerate(problems):
            if p.certificate.merit(*tolerances) < best[i][2].merit(*tolerances):
                best[i] = (p.x, p.multipliers, p.certificate)
    points, found, certificates = zip(*best, strict=True)
    return torch.stack(points), torch.stack(found), list(certificates)


def _one(at: Derivatives, i: int) -> Derivatives:
    return Derivatives(
        at.objective[i : i + 1], at.constraints[i : i + 1], at.gradient[i : i + 1], at.jacobian[i : i + 1]
    )


def _stacked(problems: list[_Problem]) -> tuple[Tensor, Tensor, Tensor]:
    """x (b, n), multipliers (b, m), which (b,)."""
    return (
        torch.stack([p.x for p in problems]),
        torch.stack([p.multipliers for p in problems]),
        torch.tensor([p.which for p in problems]),
    )


def _renew(functions: BatchedFunctions, problems: list[_Problem]) -> None:
    """Exact second derivatives for all of them; a problem whose model fails beside its point stops."""
    if not problems:
        return
    x, multipliers, which = _stacked(problems)
    gradient = torch.cat([p.at.lagrangian_gradient(p.multipliers[None]) for p in problems])
    for p, hessian in zip(problems, functions.hessians(x, which, multipliers, gradient), strict=True):
        p.hessian, p.unhelpful = hessian, 0
        p.is_going = bool(hessian.isfinite().all())


def _propose(functions: BatchedFunctions, p: _Problem) -> bool:
    """Solve the quadratic programme for the next step; False, and the problem stops, where none helps."""
    while p.is_going and SMALLEST_RADIUS <= p.radius <= LARGEST_RADIUS:
        proposal = _quadratic_step(functions, p)
        if proposal is not None:
            p.step, p.asked = proposal
            return True
        p.radius *= 2.0  # the rows cannot be met so near
    p.is_going = False
    return False


def _quadratic_step(functions: BatchedFunctions, p: _Problem) -> tuple[Tensor, Tensor] | None:
    """Step (n,) and multipliers (m,) of the convex quadratic model within the radius, for variables that no bound holds."""
    which = torch.tensor([p.which])
    lower, upper = (limit[0].numpy() for limit in functions.limits(which))
    x, multipliers = p.x.numpy(), p.multipliers.numpy()
    low, high = functions.lower[p.which].numpy(), functions.upper[p.which].numpy()
    slope, jacobian, values = p.at.gradient[0].numpy(), p.at.jacobian[0].numpy(), p.at.constraints[0].numpy()
    pressure = slope + jacobian.T @ multipliers
    is_held = ((x - low <= ON_BOUND) & (pressure > 0.0)) | ((high - x <= ON_BOUND) & (pressure < 0.0))
    free = np.flatnonzero(~is_held)
    is_equal = lower == upper
    is_open = ~is_equal & (np.isfinite(lower) | np.isfinite(upper))
    target = np.where(multipliers > 0.0, upper, lower)
    active = np.flatnonzero(is_equal | (np.abs(multipliers) > PRESSING) & np.isfinite(target))
    across, gap = jacobian[np.ix_(active, free)], (values - target)[active]
    hessian = p.hessian.numpy()[np.ix_(free, free)] + CONVEXIFICATION * across.T @ across
    curvature, axes = np.linalg.eigh(hessian)
    reach = p.radius * np.maximum(1.0, np.abs(x))
    solver = piqp.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = QUADRATIC_TOLERANCE
    solver.setup(
        (axes * np.maximum(np.abs(curvature), LEAST_CURVATURE)) @ axes.T,
        slope[free] + CONVEXIFICATION * across.T @ gap,
        jacobian[np.ix_(is_equal, free)],
        (lower - values)[is_equal],
        jacobian[np.ix_(is_open, free)],
        (lower - values)[is_open],
        (upper - values)[is_open],
        np.maximum(low - x, -reach)[free],
        np.minimum(high - x, reach)[free],
    )
    is_solved = solver.solve() == piqp.Status.PIQP_SOLVED
    left = max(solver.result.info.primal_res, solver.result.info.dual_res)
    if not (is_solved or left < 1e3 * QUADRATIC_TOLERANCE):
        return None
    step, asked = np.zeros_like(x), np.zeros_like(multipliers)
    step[free] = solver.result.x
    asked[is_equal] = solver.result.y
    asked[is_open] = solver.result.z_u - solver.result.z_l
    # What the added curvature exerts where an active row is not met to the last digit belongs to the row's multiplier.
    asked[active] += CONVEXIFICATION * (across @ step[free] + gap)
    return torch.from_numpy(step), torch.from_numpy(asked)


def _search(functions: BatchedFunctions, problems: list[_Problem]) -> list[tuple[_Problem, float]]:
    """The share of its step that each problem takes: the first of 1, 1/2, 1/4 ... that lowers its augmented Lagrangian.

    A problem that takes none shortens its radius and stays where it is.
    """
    taken, open_, share = [], problems, 1.0
    for _ in range(HALVINGS + 1):
        if not open_:
            break
        x, _, which = _stacked(open_)
        asked = torch.stack([p.asked for p in open_])
        trial = functions.clip(x + share * torch.stack([p.step for p in open_]), which)
        with torch.no_grad():
            objective, constraints = functions.values(trial, which)
        at = torch.cat([p.at.objective for p in open_]), torch.cat([p.at.constraints for p in open_])
        before, after = (_merit(functions, f, c, which, asked) for f, c in (at, (objective, constraints)))
        # Near the optimum the fall is lost in rounding: a change within it is no rise.
        is_lower = (after <= before + ROUNDING * (1.0 + before.abs())).tolist()  # False for NaN
        taken += [(p, share) for p, ok in zip(open_, is_lower, strict=True) if ok]
        open_ = [p for p, ok in zip(open_, is_lower, strict=True) if not ok]
        share *= 0.5
    for p in open_:
        p.radius = 0.1 * _length(p)
        p.hessian = None
    return taken


def _merit(functions: BatchedFunctions, objective: Tensor, constraints: Tensor, which: Tensor, asked: Tensor) -> Tensor:
    residual = functions.residual(constraints, which, asked, torch.full_like(objective, PENALTY))
    return objective + 0.5 * PENALTY * (residual**2).sum(-1)


def _length(p: _Problem) -> float:
    return float((p.step.abs() / p.x.abs().clamp(min=1.0)).max())


def _arrive(functions: BatchedFunctions, moved: list[tuple[_Problem, float]], tolerances: tuple[float, float]) -> None:
    """Go there: derivatives, certificates, radii and second derivatives of the problems that take a step."""
    if not moved:
        return
    problems = [p for p, _ in moved]
    shares = torch.tensor([share for _, share in moved], dtype=torch.float64)[:, None]
    old, multipliers, which = _stacked(problems)
    x = functions.clip(old + shares * torch.stack([p.step for p in problems]), which)
    multipliers = multipliers + shares * (torch.stack([p.asked for p in problems]) - multipliers)
    at = functions.derivatives(x, which)
    certificates = functions.certificates(x, which, multipliers, at)
    for i, (p, share) in enumerate(moved):
        length = _length(p)
        if share < 1.0:
            p.radius = share * length
        elif length > 0.99 * p.radius:
            p.radius = min(2.0 * p.radius, LARGEST_RADIUS)
        here, new = _one(at, i), multipliers[i]
        change = (here.lagrangian_gradient(new[None]) - p.at.lagrangian_gradient(new[None]))[0]
        p.hessian = _rank_one(p.hessian, x[i] - p.x, change)
        is_helpful = certificates[i].merit(*tolerances) <= HELPFUL * p.certificate.merit(*tolerances)
        p.unhelpful = 0 if is_helpful else p.unhelpful + 1
        p.x, p.multipliers, p.at, p.certificate = x[i], new, here, certificates[i]
        if p.unhelpful >= PATIENCE:
            p.hessian = None


def _rank_one(hessian: Tensor, step: Tensor, change: Tensor) -> Tensor:
    """Symmetric rank-one update: the nearest matrix of that form with hessian @ step = change."""
    missing = change - hessian @ step
    product = float(missing @ step)
    if abs(product) <= SAFE_UPDATE * float(missing.norm() * step.norm()):
        return hessian
    return hessian + torch.outer(missing, missing) / product
