"""Objective and constraints as solvers want them: NumPy in and out, scaled, with exact first and second derivatives."""

from dataclasses import dataclass, field

import numpy as np
import torch

from lpc_mdo.optimization.model import Counts, Evaluate, Model, gradient_or_zero, parts
from lpc_mdo.optimization.row_gradients import RowGradients

DIFFERENCE = 1e-5  # step of gradient differences: their truncation and rounding errors are alike there
EXACT_NOISE, DIFFERENCE_NOISE = 1e-14, 1e-5  # of second derivatives, relative to the largest
AGREEMENT = 1e-2  # relative, of second derivatives with differences of first ones


@dataclass
class Evaluator:
    """Scaled objective s_f f(x) and constraints s_c c(x), and exact derivatives, at the last point asked for.

    is_batched: `evaluate` takes (..., n) and treats every design alone; Jacobian and Hessian then come from a few evaluations
    of many points.
    """

    evaluate: Evaluate
    lower: np.ndarray
    upper: np.ndarray
    constraint_lower: np.ndarray
    constraint_upper: np.ndarray
    objective_scale: float = 1.0
    constraint_scale: np.ndarray = field(default_factory=lambda: np.ones(0))
    is_batched: bool = False
    counts: Counts = field(default_factory=Counts)
    is_twice_differentiable: bool | None = None  # by torch; None: not tried yet
    # Newton's method improves second derivatives by its steps, in place of exact ones each time.
    is_thrifty: bool = False
    model: Model = field(init=False)
    rows: RowGradients = field(init=False)

    def __post_init__(self) -> None:
        if len(self.constraint_scale) == 0:
            self.constraint_scale = np.ones(len(self.constraint_lower))
        self.model = Model(self.evaluate, len(self.constraint_lower), self.counts)
        self.rows = RowGradients(self.model, self.lower, self.upper, self.is_batched)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled constraint limits."""
        return self.constraint_lower * self.constraint_scale, self.constraint_upper * self.constraint_scale

    def values(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Scaled f and c (m,); NaN where the evaluation failed."""
        point = self.rows.at(x)
        objective = float(point.objective.detach()) * self.objective_scale
        return objective, point.constraints.detach().numpy() * self.constraint_scale

    def is_finite(self, x: np.ndarray) -> bool:
        return self.rows.at(x).is_finite

    def gradient(self, x: np.ndarray, weights: np.ndarray, objective_weight: float = 1.0) -> np.ndarray:
        """Gradient (n,) of objective_weight s_f f + weights . s_c c: one backward pass."""
        point = self.rows.at(x)
        if point.slope is not None:
            return (
                point.slope * (self.objective_scale * objective_weight)
                + (weights * self.constraint_scale) @ point.jacobian
            )
        self.counts.gradients += 1
        scaled = torch.from_numpy(weights * self.constraint_scale)
        total = point.objective * (self.objective_scale * objective_weight) + (point.constraints * scaled).sum()
        return gradient_or_zero(total, point.x, is_kept=True)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Scaled constraint Jacobian (m, n)."""
        if len(self.constraint_lower) == 0:
            return np.zeros((0, len(x)))
        return self.rows.jacobian(x) * self.constraint_scale[:, None]

    def differentiate(self, x: np.ndarray) -> None:
        """First derivatives of objective and rows at x (n,) in one batch; gradients there are sums of them from now on."""
        if self.is_batched and self.is_finite(x):
            self.rows.with_objective(x)

    def free_hessian(self, x: np.ndarray, multipliers: np.ndarray, free: np.ndarray) -> np.ndarray:
        """As `hessian`, where batches make it cheap, for the rows and columns (n,) that are free; zero among the others."""
        here, step = self.gradient(x, multipliers), self._difference_steps(x)
        moved = (x + np.diag(step))[free]
        there = np.concatenate([np.zeros((0, len(x))), *(self._gradients(p, multipliers, 1.0) for p in parts(moved))])
        hessian = np.zeros((len(x), len(x)))
        hessian[free] = (there - here) / step[free, None]
        hessian[~free] = hessian[:, ~free].T
        block = np.ix_(free, free)
        hessian[block] = 0.5 * (hessian[block] + hessian[block].T)
        return hessian

    def hessian(self, x: np.ndarray, multipliers: np.ndarray, objective_weight: float = 1.0) -> np.ndarray:
        """Second derivatives (n, n) of objective_weight s_f f + multipliers . s_c c.

        By differences of exact gradients where batches make them cheap or the model cannot be differentiated twice, else
        exact. Raises ArithmeticError where the model fails beside x.
        """
        if not self.is_batched and self.is_twice_differentiable is not False:
            exact = self._exact_hessian(x, multipliers, objective_weight)
            if self.is_twice_differentiable is None:
                self.is_twice_differentiable = self._agrees(exact, x, multipliers, objective_weight)
            if self.is_twice_differentiable and exact is not None:
                return exact
        here = self.gradient(x, multipliers, objective_weight)
        step = self._difference_steps(x)
        moved = x + np.diag(step)
        if self.is_batched:
            there = np.concatenate([self._gradients(part, multipliers, objective_weight) for part in parts(moved)])
        else:
            there = np.stack([self.gradient(point, multipliers, objective_weight) for point in moved])
            self.rows.at(x)
        columns = (there - here) / step[:, None]
        return 0.5 * (columns + columns.T)

    @property
    def curvature_noise(self) -> float:
        """Of second derivatives, relative to the largest."""
        return EXACT_NOISE if self.is_twice_differentiable and not self.is_batched else DIFFERENCE_NOISE

    def _difference_steps(self, x: np.ndarray) -> np.ndarray:
        step = DIFFERENCE * np.maximum(1.0, np.abs(x))
        return np.where(x + step > self.upper, -step, step)

    def _exact_hessian(self, x: np.ndarray, multipliers: np.ndarray, objective_weight: float) -> np.ndarray | None:
        """By differentiating the gradient again; None where torch cannot."""
        point = self.rows.at(x)
        scaled = torch.from_numpy(multipliers * self.constraint_scale)
        total = point.objective * (self.objective_scale * objective_weight) + (point.constraints * scaled).sum()
        hessian = np.zeros((len(x), len(x)))
        if not total.requires_grad:
            return hessian
        try:
            (gradient,) = torch.autograd.grad(total, point.x, create_graph=True, allow_unused=True)
            if gradient is None or not gradient.requires_grad:
                return hessian
            for i in range(len(x)):
                (row,) = torch.autograd.grad(gradient[i], point.x, retain_graph=True, allow_unused=True)
                if row is not None:
                    hessian[i] = row.numpy()
        except (RuntimeError, NotImplementedError):
            return None
        self.counts.gradients += len(x)
        return 0.5 * (hessian + hessian.T)

    def _agrees(self, hessian: np.ndarray | None, x: np.ndarray, multipliers: np.ndarray, weight: float) -> bool:
        """Whether the matrix is what gradients show along one direction: some functions lose terms without a word."""
        if hessian is None or not np.isfinite(hessian).all():
            return False
        step = 0.5 * self._difference_steps(x) * (1.0 + 0.5 * np.cos(np.arange(1, len(x) + 1)))
        here, near, far = (self.gradient(x + share * step, multipliers, weight) for share in (0.0, 1.0, 2.0))
        self.rows.at(x)
        shown, expected = 2.0 * near - 1.5 * here - 0.5 * far, hessian @ step
        if not np.isfinite(shown).all():
            return True
        noise = 1e-11 * float(np.abs(here).max(initial=0.0))
        size = max(float(np.abs(shown).max(initial=0.0)), float(np.abs(expected).max(initial=0.0)))
        missed = float(np.abs(shown - expected).max(initial=0.0))
        return missed <= AGREEMENT * size + noise or missed <= float(np.abs(step).max()) ** 3

    def curvature_along(self, x: np.ndarray, multipliers: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Second derivatives of s_f f + multipliers . s_c c at x (n,), times the direction (n,)."""
        size = float(np.abs(direction).max(initial=0.0))
        if size == 0.0:
            return np.zeros_like(x)
        if self.is_twice_differentiable is None and not self.is_batched:
            exact = self._product(x, multipliers, direction)
            shown = self._difference_along(x, multipliers, direction / size) * size
            largest = max(float(np.abs(shown).max()), 1e-300)
            self.is_twice_differentiable = exact is not None and bool(
                np.abs(exact - shown).max() <= AGREEMENT * largest
            )
        if self.is_twice_differentiable and not self.is_batched:
            product = self._product(x, multipliers, direction)
            if product is not None:
                return product
        return self._difference_along(x, multipliers, direction / size) * size

    def _difference_along(self, x: np.ndarray, multipliers: np.ndarray, direction: np.ndarray) -> np.ndarray:
        step = DIFFERENCE * max(1.0, float(np.abs(x).max(initial=0.0)))
        here = self.gradient(x, multipliers)
        there = self.gradient(x + step * direction, multipliers)
        self.rows.at(x)
        return (there - here) / step

    def _product(self, x: np.ndarray, multipliers: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """Exact; None where torch cannot."""
        point = self.rows.at(x)
        total = point.objective * self.objective_scale
        total = total + (point.constraints * torch.from_numpy(multipliers * self.constraint_scale)).sum()
        self.counts.gradients += 1
        if not total.requires_grad:
            return np.zeros_like(x)
        try:
            (gradient,) = torch.autograd.grad(total, point.x, create_graph=True, allow_unused=True)
            if gradient is None or not gradient.requires_grad:
                return np.zeros_like(x)
            return gradient_or_zero(gradient @ torch.from_numpy(direction), point.x, is_kept=True)
        except (RuntimeError, NotImplementedError):
            return None

    def _gradients(self, points: np.ndarray, multipliers: np.ndarray, objective_weight: float) -> np.ndarray:
        """Gradients of the Lagrangian at points (k, n), in one evaluation."""
        leaf, objective, constraints = self.model.at_all(points)
        weights = torch.from_numpy(multipliers * self.constraint_scale)
        total = self.objective_scale * objective_weight * objective.sum() + (constraints @ weights).sum()
        return gradient_or_zero(total, leaf)
