"""The quadratic model of Newton's method and the steps that it proposes.

Curvature is made positive where it counts, on the null space of the rows that hold with equality (Nocedal and Wright,
Numerical Optimization, 2006, sec. 18.4); across them only as much is added as a convex programme needs, which
changes no step that meets them. Quadratic programmes are solved by PIQP.
"""

from dataclasses import dataclass, replace

import numpy as np
import piqp

from lpc_mdo.optimization.certificate import is_pressing
from lpc_mdo.optimization.functions import Functions

FLAT = 1e-2  # of the stiffness: damping is that of a variable that curves at least so much
RANK = 1e-8  # singular values below this share of the largest belong to rows that repeat others
TOLERANCE = 1e-11  # of the quadratic programme
ACCEPTED = 1e-6  # what a programme that stopped early may leave
LARGEST_STEP = 2.0  # of a variable, relative to max(1, |x|)
ON_BOUND = 1e-9
MET = 1e-10  # beyond a limit, of rows with slopes of one
SNAPPED = 1e-6  # distance from a bound that presses harder, within which a step ends on it


@dataclass(frozen=True)
class Proposal:
    """A step (n,) and its multipliers (m,)."""

    step: np.ndarray
    multipliers: np.ndarray
    slope: float  # of the objective along the step


@dataclass(frozen=True)
class QuadraticModel:
    """Quadratic objective and linear rows at a point, for the variables that no bound holds."""

    hessian: np.ndarray  # (free, free) of the Lagrangian
    gradient: np.ndarray  # (free,) of the objective
    jacobian: np.ndarray  # (m, free)
    row_lower: np.ndarray  # (m,)
    row_upper: np.ndarray
    free: np.ndarray  # indices
    below: np.ndarray  # (free,) limits of the step
    above: np.ndarray
    size: int
    across: np.ndarray  # (free, rank) spanning the rows that hold with equality
    along: np.ndarray  # (free, free - rank) spanning their null space
    active: np.ndarray  # those rows
    curvature: np.ndarray  # (free - rank,) of the Lagrangian along `axes`, least first
    axes: np.ndarray  # (free, free - rank) in the null space
    noise: float  # of the second derivatives, relative to the largest

    @property
    def stiffness(self) -> float:
        """The largest curvature, by which others are called flat; one where nothing curves."""
        return float(np.abs(self.hessian).max(initial=0.0)) or 1.0

    def minimize(self, damping: float) -> Proposal | None:
        """The best step that meets the linear rows; None where none does.

        Every variable's curvature is raised by the share `damping`. The programme is brought to size one, so
        that the solver's tolerances mean the same for every problem.
        """
        is_equal = self.row_lower == self.row_upper
        equal, other = np.flatnonzero(is_equal), np.flatnonzero(~is_equal)
        convex = self._convex(damping)
        size = max(self.stiffness, float(np.abs(self.gradient).max(initial=0.0)))
        slope = np.abs(self.jacobian).max(axis=1, initial=0.0)
        rows = np.where(slope > 0.0, slope, 1.0)
        jacobian, lower, upper = self.jacobian / rows[:, None], self.row_lower / rows, self.row_upper / rows
        solver = piqp.DenseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = TOLERANCE
        solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = TOLERANCE
        solver.setup(
            convex / size,
            self.gradient / size,
            jacobian[equal],
            lower[equal],
            jacobian[other],
            lower[other],
            upper[other],
            self.below,
            self.above,
        )
        is_solved = solver.solve() == piqp.Status.PIQP_SOLVED
        left = max(solver.result.info.primal_res, solver.result.info.dual_res)
        if not (is_solved or left < ACCEPTED):
            return None
        step, multipliers = np.zeros(self.size), np.zeros(len(self.row_lower))
        inside = self._snapped(solver)
        multipliers[equal] = solver.result.y
        pressed = solver.result.z_u - solver.result.z_l
        ends = jacobian[other] @ inside
        slack = np.where(pressed > 0.0, upper[other] - ends, ends - lower[other])
        multipliers[other] = np.where(np.abs(pressed) > slack, pressed, 0.0)  # a hair of it on rows that do not hold
        goal = np.where(multipliers > 0.0, upper, lower)
        inside, multipliers = self._exact(convex / size, jacobian, goal, lower, upper, inside, multipliers)
        step[self.free] = inside
        return Proposal(step, multipliers * size / rows, float(self.gradient @ inside))

    def _exact(
        self,
        hessian: np.ndarray,
        jacobian: np.ndarray,
        goal: np.ndarray,
        lower: np.ndarray,
        upper: np.ndarray,
        step: np.ndarray,
        multipliers: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Step (free,) and multipliers (m,) with the rows and bounds that hold met to rounding, by one linear solve.

        An interior-point method ends a hair inside them. Its own answer stands where the active set was not yet clear, so
        that the exact step breaks another limit or a multiplier changes sign.
        """
        holds = (multipliers != 0.0) | (lower == upper)
        moving = (step > self.below) & (step < self.above)
        matrix, count = jacobian[holds][:, moving], int(moving.sum())
        system = np.block([[hessian[np.ix_(moving, moving)], matrix.T], [matrix, np.zeros((len(matrix),) * 2)]])
        fixed = np.where(moving, 0.0, step)
        scaled = self.gradient / max(self.stiffness, float(np.abs(self.gradient).max(initial=0.0)))
        right = np.concatenate([-(scaled + hessian @ fixed)[moving], (goal - jacobian @ fixed)[holds]])
        try:
            found = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:
            return step, multipliers
        exact, forces = fixed.copy(), np.zeros_like(multipliers)
        exact[moving], forces[holds] = found[:count], found[count:]
        ends = jacobian @ exact
        is_inside = bool((exact >= self.below).all() and (exact <= self.above).all())
        meets = bool((ends >= lower - MET).all() and (ends <= upper + MET).all())
        keeps_signs = bool((forces * multipliers)[lower < upper].min(initial=0.0) >= 0.0)
        return (
            (exact, forces) if np.isfinite(found).all() and is_inside and meets and keeps_signs else (step, multipliers)
        )

    def _snapped(self, solver: piqp.DenseSolver) -> np.ndarray:
        """The programme's step (free,), on the bounds that hold it: an interior-point method ends a hair before them."""
        step = np.clip(solver.result.x, self.below, self.above)
        held = solver.result.z_bl - solver.result.z_bu
        step = np.where((held > step - self.below) & (step - self.below <= SNAPPED), self.below, step)
        return np.where((-held > self.above - step) & (self.above - step <= SNAPPED), self.above, step)

    def _convex(self, damping: float) -> np.ndarray:
        """A convex Hessian that gives the same steps along the active rows as far as those steps descend.

        Along the rows' null space negative curvature changes sign. Across it as much is added as makes the whole convex:
        that changes no step that meets the rows, and its multipliers only by as much as the rows are missed.
        """
        least = self.noise * self.stiffness
        positive = np.maximum(np.abs(self.curvature), least)
        convex = self.hessian + (self.axes * (positive - self.curvature)) @ self.axes.T
        if self.across.shape[1]:
            coupling = self.across.T @ self.hessian @ self.axes
            rest = self.across.T @ self.hessian @ self.across - (coupling / positive) @ coupling.T
            raised = max(0.0, least - float(np.linalg.eigvalsh(rest).min()))
            convex = convex + raised * self.across @ self.across.T
        if damping > 0.0:
            size = np.abs(np.diag(self.hessian))
            convex = convex + damping * np.diag(np.maximum(size, FLAT * self.stiffness))
        return 0.5 * (convex + convex.T)

    def shifted(self, change: np.ndarray) -> "QuadraticModel":
        """The same model with rows (m,) whose values are greater by `change`."""
        return replace(self, row_lower=self.row_lower - change, row_upper=self.row_upper - change)


def is_free(evaluator: Functions, x: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Mask (n,) of the variables at x (n,) that no bound holds against the Lagrangian's gradient `pressure` (n,)."""
    on_lower, on_upper = x - evaluator.lower <= ON_BOUND, evaluator.upper - x <= ON_BOUND
    return ~((on_lower & (pressure > 0.0)) | (on_upper & (pressure < 0.0)))


def quadratic_model(
    evaluator: Functions, x: np.ndarray, multipliers: np.ndarray, hessian: np.ndarray | None = None
) -> QuadraticModel:
    """The model at x (n,) for scaled multipliers (m,); hessian (n, n) of the Lagrangian, default: exact.

    Raises ArithmeticError where a derivative is not finite.
    """
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    jacobian = evaluator.jacobian(x)
    gradient = evaluator.gradient(x, np.zeros_like(values))
    free = np.flatnonzero(is_free(evaluator, x, gradient + jacobian.T @ multipliers))
    active = np.flatnonzero((lower == upper) | is_pressing(multipliers, values, lower, upper))
    hessian = (evaluator.hessian(x, multipliers) if hessian is None else hessian)[np.ix_(free, free)]
    if not (np.isfinite(hessian).all() and np.isfinite(jacobian).all() and np.isfinite(gradient).all()):
        raise FloatingPointError("derivatives are not finite")
    _, size, right = np.linalg.svd(jacobian[np.ix_(active, free)], full_matrices=True)
    rank = int((size > RANK * size.max(initial=0.0)).sum())
    along = right[rank:].T
    curvature, axes = np.linalg.eigh(along.T @ hessian @ along)
    reach = LARGEST_STEP * np.maximum(1.0, np.abs(x))
    return QuadraticModel(
        hessian=hessian,
        gradient=gradient[free],
        jacobian=jacobian[:, free],
        row_lower=lower - values,
        row_upper=np.where(lower == upper, lower - values, upper - values),
        free=free,
        below=np.maximum(evaluator.lower - x, -reach)[free],
        above=np.minimum(evaluator.upper - x, reach)[free],
        size=len(x),
        across=right[:rank].T,
        along=along,
        active=active,
        curvature=curvature,
        axes=along @ axes,
        noise=evaluator.curvature_noise,
    )
