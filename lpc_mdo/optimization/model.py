"""A problem as solvers ask it: at a point, kept with its graph, or at many at once; failures are NaN, work is counted."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

Evaluate = Callable[[Tensor], tuple[Tensor, Tensor]]
BATCH = 24  # designs evaluated at a time: larger batches no longer gain, and cost memory


class TimeLimit(Exception):
    """The time limit was reached."""


@dataclass
class Counts:
    """Work done so far."""

    outer: int = 0  # steps of Newton's method and restorations, inner solves
    inner: int = 0  # iterations in inner solves
    evaluations: int = 0
    gradients: int = 0


@dataclass
class Point:
    """One evaluated point with its graph."""

    key: bytes
    x: Tensor
    objective: Tensor
    constraints: Tensor
    is_finite: bool
    jacobian: np.ndarray | None = None  # (m, n), unscaled
    slope: np.ndarray | None = None  # (n,) of the objective, unscaled


@dataclass
class Model:
    """Unscaled objective f and `size` rows c by `evaluate`, at the last point asked for or at many points."""

    evaluate: Evaluate
    size: int
    counts: Counts = field(default_factory=Counts)
    deadline: float = float("inf")  # time.monotonic() from which nothing is evaluated any more
    _point: Point | None = None

    def require_time(self) -> None:
        """Raises TimeLimit once the deadline has passed: the one place that holds it, in whatever phase."""
        if time.monotonic() > self.deadline:
            raise TimeLimit

    def is_at(self, x: np.ndarray) -> bool:
        """Whether x (n,) is the point that is kept."""
        return self._point is not None and self._point.key == x.tobytes()

    def at(self, x: np.ndarray) -> Point:
        """The point x (n,), evaluated unless it is the one that is kept."""
        key = x.tobytes()
        if self._point is None or self._point.key != key:
            self.require_time()
            leaf = torch.tensor(x, dtype=torch.float64, requires_grad=True)
            self.counts.evaluations += 1
            try:
                objective, constraints = self.evaluate(leaf)
            except ArithmeticError:
                failed = leaf.sum() * float("nan")
                objective, constraints = failed, failed * torch.ones(self.size, dtype=torch.float64)
            is_finite = bool(objective.isfinite() & constraints.isfinite().all())
            self._point = Point(key, leaf, objective, constraints, is_finite)
        return self._point

    def at_all(self, points: np.ndarray) -> tuple[Tensor, Tensor, Tensor]:
        """Leaf (k, n), objective (k,) and rows (k, m) of points (k, n) whose gradients are wanted, by one evaluation."""
        self.require_time()
        leaf = torch.tensor(points, dtype=torch.float64, requires_grad=True)
        objective, constraints = self.evaluate(leaf)
        self.counts.evaluations += len(points)
        self.counts.gradients += len(points)
        return leaf, objective, constraints


def gradient_or_zero(total: Tensor, leaf: Tensor, is_kept: bool = False) -> np.ndarray:
    """Zero where the total does not depend on the leaf; is_kept: the graph is needed again."""
    if not total.requires_grad:
        return np.zeros(leaf.shape)
    (gradient,) = torch.autograd.grad(total, leaf, retain_graph=is_kept, allow_unused=True)
    return np.zeros(leaf.shape) if gradient is None else gradient.numpy()


def parts(items: np.ndarray) -> list[np.ndarray]:
    """Consecutive parts of at most BATCH items."""
    return [items[first : first + BATCH] for first in range(0, len(items), BATCH)]
