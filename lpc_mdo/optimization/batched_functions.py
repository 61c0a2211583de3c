"""Objectives and constraints of many problems at once: scaled, differentiated, tolerant of failed evaluations."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.optimization.certificate import Certificate

BatchEvaluate = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""Points (b, n) and the problem (b,) of each, to objectives (b,) and constraints (b, m); every point alone."""

Observe = Callable[[Tensor, Tensor, Tensor], None]
"""Told which problems (b,) have looked at a design, its objectives (b,) and constraints (b, m), unscaled."""

BATCH = 48  # designs evaluated at a time for second derivatives
DIFFERENCE = 1e-5  # step of gradient differences: their truncation and rounding errors are alike there
SMALLEST_SCALE = 1e-16


@dataclass(frozen=True)
class Derivatives:
    """At points (b, n) of their problems: scaled values and first derivatives."""

    objective: Tensor  # (b,)
    constraints: Tensor  # (b, m)
    gradient: Tensor  # (b, n) of the objective
    jacobian: Tensor  # (b, m, n)

    def lagrangian_gradient(self, multipliers: Tensor) -> Tensor:
        """(b, n) for multipliers (b, m)."""
        return self.gradient + torch.einsum("bm,bmn->bn", multipliers, self.jacobian)


@dataclass
class BatchedFunctions:
    """k problems of n variables and m rows. `which` (b,) names the problem of every point."""

    evaluate: BatchEvaluate
    lower: Tensor  # (k, n)
    upper: Tensor
    constraint_lower: Tensor  # (k, m), unscaled
    constraint_upper: Tensor
    objective_scale: Tensor  # (k,)
    constraint_scale: Tensor  # (k, m)
    observe: Observe = lambda which, objective, constraints: None  # every design of a search, none of a difference
    evaluations: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))  # (k,), and
    gradients: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))  # counts of each problem

    def __post_init__(self) -> None:
        self.evaluations, self.gradients = (np.zeros(len(self.lower), dtype=int) for _ in range(2))

    def limits(self, which: Tensor) -> tuple[Tensor, Tensor]:
        """Scaled limits (b, m)."""
        scale = self.constraint_scale[which]
        return self.constraint_lower[which] * scale, self.constraint_upper[which] * scale

    def clip(self, x: Tensor, which: Tensor) -> Tensor:
        return torch.maximum(torch.minimum(x, self.upper[which]), self.lower[which])

    def values(self, x: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        """Scaled objectives (b,) and rows (b, m); NaN where the model fails. Differentiable if x asks for it."""
        np.add.at(self.evaluations, which.numpy(), 1)
        objective, constraints = self._evaluated(x, which)
        return objective * self.objective_scale[which], constraints * self.constraint_scale[which]

    def _evaluated(self, x: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        try:
            return self.evaluate(x, which)
        except ArithmeticError:
            if len(x) == 1:
                nothing = x.sum(-1) * float("nan")
                return nothing, nothing[:, None].expand(1, self.constraint_lower.shape[1])
        # One of the points has no solution: the others must not suffer.
        parts = [self._evaluated(x[i : i + 1], which[i : i + 1]) for i in range(len(x))]
        objectives, constraints = zip(*parts, strict=True)
        return torch.cat(objectives), torch.cat(constraints)

    def augmented(
        self, x: Tensor, which: Tensor, multipliers: Tensor, penalty: Tensor
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """f + rho/2 |c + lambda/rho - its projection on the limits|^2: value (b,), gradient (b, n), and f and c."""
        leaf = x.detach().requires_grad_(True)
        objective, constraints = self.values(leaf, which)
        value = objective + 0.5 * penalty * (self.residual(constraints, which, multipliers, penalty) ** 2).sum(-1)
        np.add.at(self.gradients, which.numpy(), 1)
        f, c = objective.detach(), constraints.detach()
        self._tell(which, f, c)
        return value.detach(), _gradient(value, leaf), f, c

    def _tell(self, which: Tensor, objective: Tensor, constraints: Tensor) -> None:
        self.observe(which, objective / self.objective_scale[which], constraints / self.constraint_scale[which])

    def residual(self, constraints: Tensor, which: Tensor, multipliers: Tensor, penalty: Tensor) -> Tensor:
        """(b, m) c + lambda/rho less its projection on the limits; multipliers (b, m), penalty (b,)."""
        shifted = constraints + multipliers / penalty[:, None]
        return shifted - torch.maximum(torch.minimum(shifted, self.limits(which)[1]), self.limits(which)[0])

    def derivatives(self, x: Tensor, which: Tensor) -> Derivatives:
        """Values and first derivatives of objective and every row: one graph, one backward pass a row."""
        leaf = x.detach().requires_grad_(True)
        objective, constraints = self.values(leaf, which)
        outputs = [objective, *constraints.unbind(-1)]
        gradient, *rows = [_gradient(output, leaf, is_last=output is outputs[-1]) for output in outputs]
        np.add.at(self.gradients, which.numpy(), len(outputs))
        jacobian = torch.stack(rows, dim=1) if rows else x.new_zeros(len(x), 0, x.shape[1])
        self._tell(which, objective.detach(), constraints.detach())
        return Derivatives(objective.detach(), constraints.detach(), gradient, jacobian)

    def hessians(self, x: Tensor, which: Tensor, multipliers: Tensor, gradient: Tensor) -> Tensor:
        """(b, n, n) second derivatives of the Lagrangian by differences of exact gradients, all problems together.

        gradient (b, n): the Lagrangian's at x.
        """
        count, size = x.shape
        step = DIFFERENCE * x.abs().clamp(min=1.0)
        step = torch.where(x + step > self.upper[which], -step, step)
        moved = (x[:, None] + torch.diag_embed(step)).reshape(count * size, size)
        owner = torch.arange(count).repeat_interleave(size)
        parts = [self._lagrangian_gradients(m, which[o], multipliers[o]) for m, o in _parts(moved, owner)]
        columns = (torch.cat(parts).reshape(count, size, size) - gradient[:, None]) / step[:, :, None]
        return 0.5 * (columns + columns.transpose(1, 2))

    def _lagrangian_gradients(self, x: Tensor, which: Tensor, multipliers: Tensor) -> Tensor:
        leaf = x.requires_grad_(True)
        objective, constraints = self.values(leaf, which)
        np.add.at(self.gradients, which.numpy(), 1)
        return _gradient(objective + (multipliers * constraints).sum(-1), leaf)

    def certificates(self, x: Tensor, which: Tensor, multipliers: Tensor, at: Derivatives) -> list[Certificate]:
        """Of every point, as `certify` gives it for one problem."""
        lower, upper = self.limits(which)
        step = (x - self.clip(x - at.lagrangian_gradient(multipliers), which)).abs()
        beyond = self.violations(at.constraints, which)
        slack = torch.where(multipliers > 0.0, upper - at.constraints, at.constraints - lower).clamp(min=0.0)
        slack, size = torch.where(multipliers == 0.0, 0.0, slack), multipliers.abs()
        product = torch.where(lower < upper, torch.maximum(torch.minimum(size, slack), size * slack), 0.0)
        return [
            Certificate(
                stationarity=_largest(step[i]),
                feasibility=_largest(beyond[i]),
                complementarity=_largest(product[i]),
                worst_variable=int(step[i].argmax()) if step.shape[1] else -1,
                worst_constraint=int(beyond[i].argmax()) if beyond.shape[1] else -1,
            )
            for i in range(len(x))
        ]

    def violations(self, constraints: Tensor, which: Tensor) -> Tensor:
        """(b, m) distances beyond the limits."""
        lower, upper = self.limits(which)
        return torch.maximum(lower - constraints, constraints - upper).clamp(min=0.0)


def scaled_functions(
    evaluate: BatchEvaluate,
    x: Tensor,
    lower: Tensor,
    upper: Tensor,
    constraint_lower: Tensor,
    constraint_upper: Tensor,
    observe: Observe,
) -> BatchedFunctions:
    """Functions whose gradients larger than one at x (k, n) are brought to one, as for a single problem."""
    limits = lower, upper, constraint_lower, constraint_upper
    ones = lower.new_ones(len(x)), torch.ones_like(constraint_lower)
    functions = BatchedFunctions(evaluate, *limits, *ones, observe)
    at = functions.derivatives(x, torch.arange(len(x)))
    functions.objective_scale = _scale(at.gradient.abs().amax(-1))
    functions.constraint_scale = _scale(at.jacobian.abs().amax(-1))
    return functions


def _scale(size: Tensor) -> Tensor:
    return (1.0 / size.clamp(min=1.0)).clamp(min=SMALLEST_SCALE)


def _gradient(outputs: Tensor, leaf: Tensor, is_last: bool = True) -> Tensor:
    """Gradients (b, n) of outputs (b,), each of its own point; zero where there is no dependence.

    is_last: nobody asks the graph again, which frees it on the way.
    """
    if not outputs.requires_grad:
        return torch.zeros_like(leaf)
    (gradient,) = torch.autograd.grad(outputs.sum(), leaf, retain_graph=not is_last, allow_unused=True)
    return torch.zeros_like(leaf) if gradient is None else gradient


def _largest(values: Tensor) -> float:
    return float(values.max()) if len(values) else 0.0


def _parts(points: Tensor, owners: Tensor) -> list[tuple[Tensor, Tensor]]:
    return list(zip(points.split(BATCH), owners.split(BATCH), strict=True))
