"""Objective and constraints as solvers want them: NumPy in and out, scaled, cached, tolerant of failed evaluations.

More than 300 lines because every derivative, of first or second order, exact or by differences, is taken at the one cached point.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import Tensor

Evaluate = Callable[[Tensor], tuple[Tensor, Tensor]]
AFFINE_TOLERANCE = 1e-10
SUM_TOLERANCE = 1e-9  # relative, of gradients of sums of rows with sums of their gradients
BATCH = 24  # designs evaluated at a time: larger batches no longer gain, and cost memory
DIFFERENCE = 1e-5  # step of gradient differences: their truncation and rounding errors are alike there
EXACT_NOISE, DIFFERENCE_NOISE = 1e-14, 1e-5  # of second derivatives, relative to the largest
AGREEMENT = 1e-2  # relative, of second derivatives with differences of first ones


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
class _Point:
    """One evaluated point with its graph."""

    key: bytes
    x: Tensor
    objective: Tensor
    constraints: Tensor
    is_finite: bool
    jacobian: np.ndarray | None = None  # (m, n), unscaled
    slope: np.ndarray | None = None  # (n,) of the objective, unscaled


@dataclass
class _Affine:
    """Linear forms of the rows, unscaled: jacobian @ x + offset where `rows` says that they are affine."""

    rows: np.ndarray  # (m,)
    jacobian: np.ndarray  # (m, n)
    offset: np.ndarray  # (m,)

    def check(self, x: np.ndarray, actual: np.ndarray) -> None:
        """Take rows off that their form does not give at x (n,), where their values are `actual` (m,)."""
        size = 1.0 + np.abs(self.jacobian) @ np.abs(x)
        self.rows &= np.abs(actual - (self.jacobian @ x + self.offset)) <= 1e-8 * size


@dataclass
class Evaluator:
    """Scaled objective s_f f(x) and constraints s_c c(x), and exact derivatives, at the last point asked for.

    The Jacobian of rows that are affine is computed once: rows whose gradients agree at two points are taken as affine
    and checked against their linear form at every later evaluation. is_batched: `evaluate` takes (..., n) and treats every
    design alone; Jacobian and Hessian then come from a few evaluations of many points. Rows that share no variable are then
    differentiated as one sum (Curtis, Powell and Reid 1974, by rows); a product of the whole Jacobian checks each time that they
    share none.
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
    is_thrifty: bool = (
        False  # Newton's method improves second derivatives by its steps, in place of exact ones each time
    )
    deadline: float = float("inf")  # time.monotonic() from which no model is evaluated any more
    _point: _Point | None = None
    _affine: _Affine | None = None
    _pattern: np.ndarray | None = None  # (m, n) where gradients of rows were not zero

    def __post_init__(self) -> None:
        if len(self.constraint_scale) == 0:
            self.constraint_scale = np.ones(len(self.constraint_lower))

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled constraint limits."""
        return self.constraint_lower * self.constraint_scale, self.constraint_upper * self.constraint_scale

    def require_time(self) -> None:
        """Raises TimeLimit once the deadline has passed: the one place that holds it, in whatever phase."""
        if time.monotonic() > self.deadline:
            raise TimeLimit

    def _at(self, x: np.ndarray) -> _Point:
        key = x.tobytes()
        if self._point is None or self._point.key != key:
            self.require_time()
            leaf = torch.tensor(x, dtype=torch.float64, requires_grad=True)
            self.counts.evaluations += 1
            try:
                objective, constraints = self.evaluate(leaf)
            except ArithmeticError:
                objective, constraints = (
                    leaf.sum() * float("nan"),
                    leaf.sum() * torch.full((len(self.constraint_lower),), float("nan")),
                )
            is_finite = bool(objective.isfinite() & constraints.isfinite().all())
            self._point = _Point(key, leaf, objective, constraints, is_finite)
            if is_finite and self._affine is not None:
                self._affine.check(x, constraints.detach().numpy())
        return self._point

    def values(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Scaled f and c (m,); NaN where the evaluation failed."""
        point = self._at(x)
        objective = float(point.objective.detach()) * self.objective_scale
        return objective, point.constraints.detach().numpy() * self.constraint_scale

    def is_finite(self, x: np.ndarray) -> bool:
        return self._at(x).is_finite

    def gradient(self, x: np.ndarray, weights: np.ndarray, objective_weight: float = 1.0) -> np.ndarray:
        """Gradient (n,) of objective_weight s_f f + weights . s_c c: one backward pass."""
        point = self._at(x)
        if point.slope is not None:
            return (
                point.slope * (self.objective_scale * objective_weight)
                + (weights * self.constraint_scale) @ point.jacobian
            )
        self.counts.gradients += 1
        scaled = torch.from_numpy(weights * self.constraint_scale)
        total = point.objective * (self.objective_scale * objective_weight) + (point.constraints * scaled).sum()
        return _gradient_or_zero(total, point.x, is_kept=True)

    @property
    def affine_rows(self) -> np.ndarray:
        """Mask (m,) of the rows known to be affine, once a Jacobian has been asked for."""
        return np.zeros(len(self.constraint_lower), dtype=bool) if self._affine is None else self._affine.rows.copy()

    def inherit_affine(
        self, whole: "Evaluator", rows: np.ndarray, columns: Callable[[np.ndarray], np.ndarray], offset: np.ndarray
    ) -> None:
        """Take over which rows of `whole` are affine; columns: from derivatives in its x to those in the z of x = ... + offset."""
        known = whole._affine
        if known is not None:
            jacobian = known.jacobian[rows]
            self._affine = _Affine(known.rows[rows], columns(jacobian), known.offset[rows] + jacobian @ offset)
        if whole._pattern is not None:  # with numbers that do not cancel
            self._pattern = columns(np.where(whole._pattern[rows], np.sqrt(np.arange(2, len(offset) + 2)), 0.0)) != 0.0

    def free_hessian(self, x: np.ndarray, multipliers: np.ndarray, free: np.ndarray) -> np.ndarray:
        """As `hessian`, where batches make it cheap, for the rows and columns (n,) that are free; zero among the others."""
        here, step = self.gradient(x, multipliers), self._difference_steps(x)
        moved = (x + np.diag(step))[free]
        there = np.concatenate([np.zeros((0, len(x))), *(self._gradients(p, multipliers, 1.0) for p in _parts(moved))])
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
            there = np.concatenate([self._gradients(part, multipliers, objective_weight) for part in _parts(moved)])
        else:
            there = np.stack([self.gradient(point, multipliers, objective_weight) for point in moved])
            self._at(x)
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
        point = self._at(x)
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
        self._at(x)
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
        self._at(x)
        return (there - here) / step

    def _product(self, x: np.ndarray, multipliers: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """Exact; None where torch cannot."""
        point = self._at(x)
        total = point.objective * self.objective_scale
        total = total + (point.constraints * torch.from_numpy(multipliers * self.constraint_scale)).sum()
        self.counts.gradients += 1
        if not total.requires_grad:
            return np.zeros_like(x)
        try:
            (gradient,) = torch.autograd.grad(total, point.x, create_graph=True, allow_unused=True)
            if gradient is None or not gradient.requires_grad:
                return np.zeros_like(x)
            return _gradient_or_zero(gradient @ torch.from_numpy(direction), point.x, is_kept=True)
        except (RuntimeError, NotImplementedError):
            return None

    def _gradients(self, points: np.ndarray, multipliers: np.ndarray, objective_weight: float) -> np.ndarray:
        """Gradients of the Lagrangian at points (k, n), in one evaluation."""
        self.require_time()
        leaf = torch.tensor(points, dtype=torch.float64, requires_grad=True)
        objective, constraints = self.evaluate(leaf)
        weights = torch.from_numpy(multipliers * self.constraint_scale)
        total = self.objective_scale * objective_weight * objective.sum() + (constraints @ weights).sum()
        self.counts.evaluations += len(points)
        self.counts.gradients += len(points)
        return _gradient_or_zero(total, leaf)

    def _raw_rows(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Gradients (row, n) of the given rows, unscaled."""
        if self.is_batched and len(rows) > 1:
            return self._rows_of_copies(x, rows)
        point = self._at(x)
        jacobian = np.zeros((len(rows), len(x)))
        for i, row in enumerate(rows):
            jacobian[i] = _gradient_or_zero(point.constraints[row], point.x, is_kept=True)
        self.counts.gradients += len(rows)
        return jacobian

    def _rows_of_copies(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """As `_raw_rows`, row -1 the objective: one copy of the point for every group of rows, one backward pass for all."""
        pattern = self._pattern
        if pattern is None:
            return self._one_by_one(x, rows)
        groups, found = _disjoint(rows, pattern), np.zeros((len(rows), len(x)))
        place = {int(row): i for i, row in enumerate(rows)}
        for part in _parts(np.arange(len(groups))):
            of_part = [groups[i] for i in part]
            for group, gradient in zip(of_part, self._sums_of_copies(x, of_part), strict=True):
                for row in group:
                    found[place[row]] = gradient if len(group) == 1 else np.where(pattern[row], gradient, 0.0)
        if len(groups) < len(rows) and not self._adds_up(
            x, rows, found
        ):  # rows share variables that they did not before
            found = self._one_by_one(x, rows)
            pattern[rows[rows >= 0]] |= found[rows >= 0] != 0.0
        return found

    def _one_by_one(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Gradients (row, n) of rows, a copy for each."""
        groups = [[int(row)] for row in rows]
        parts = [[groups[i] for i in part] for part in _parts(np.arange(len(groups)))]
        return np.concatenate([self._sums_of_copies(x, part) for part in parts])

    def _sums_of_copies(self, x: np.ndarray, groups: list[list[int]]) -> np.ndarray:
        """Gradients (group, n) of sums of rows."""
        self.require_time()
        copies = torch.tensor(np.repeat(x[None], len(groups), axis=0), dtype=torch.float64, requires_grad=True)
        objective, constraints = self.evaluate(copies)
        self.counts.evaluations += len(groups)
        self.counts.gradients += len(groups)
        pairs = [(i, row) for i, group in enumerate(groups) for row in group if row >= 0]
        total = constraints[tuple(torch.tensor(pairs).T)].sum() if pairs else constraints.sum() * 0.0
        of_objective = [i for i, group in enumerate(groups) if group == [-1]]
        if of_objective:
            total = total + objective[of_objective].sum()
        return _gradient_or_zero(total, copies)

    def _adds_up(self, x: np.ndarray, rows: np.ndarray, found: np.ndarray) -> bool:
        """Whether a weighted sum of the rows has the gradient that theirs give."""
        is_row = rows >= 0
        wave, weights = np.cos(np.arange(1, len(rows) + 1)), np.zeros(len(self.constraint_lower))
        weights[rows[is_row]] = wave[is_row]
        point = self._at(x)
        shown = _gradient_or_zero((point.constraints * torch.from_numpy(weights)).sum(), point.x, is_kept=True)
        self.counts.gradients += 1
        size = np.abs(wave[is_row]) @ np.abs(found[is_row])
        return bool((np.abs(shown - wave[is_row] @ found[is_row]) <= SUM_TOLERANCE * (1.0 + size)).all())

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Scaled constraint Jacobian (m, n)."""
        count = len(self.constraint_lower)
        if count == 0:
            return np.zeros((0, len(x)))
        affine = self._affine or self._find_affine(x)
        point = self._at(x)
        if point.jacobian is None:
            point.jacobian = affine.jacobian.copy()
            curved = np.flatnonzero(~affine.rows)
            point.jacobian[curved] = self._raw_rows(x, curved)
        return point.jacobian * self.constraint_scale[:, None]

    def differentiate(self, x: np.ndarray) -> None:
        """First derivatives of objective and rows at x (n,) in one batch; gradients there are sums of them from now on."""
        if not self.is_batched or not self.is_finite(x):
            return
        affine = self._affine or self._find_affine(x)
        point = self._at(x)
        if point.slope is not None:
            return
        curved = np.flatnonzero(~affine.rows)
        found = self._rows_of_copies(x, np.append(-1, curved))
        point.jacobian = affine.jacobian.copy()
        point.jacobian[curved], point.slope = found[1:], found[0]

    def _find_affine(self, x: np.ndarray) -> _Affine:
        rows = np.arange(len(self.constraint_lower))
        here = self._raw_rows(x, rows)
        offset = self._at(x).constraints.detach().numpy() - here @ x
        wave = 0.01 * np.cos(np.arange(1, len(x) + 1))  # any fixed direction that favours no variable
        moved = np.clip(x + wave, self.lower, self.upper)
        if not self.is_finite(moved):
            is_affine = np.zeros(len(rows), dtype=bool)
        else:
            self._pattern = here != 0.0
            there = self._raw_rows(moved, rows)
            size = 1.0 + np.abs(here).max(axis=1, initial=0.0)
            is_affine = np.abs(there - here).max(axis=1, initial=0.0) <= AFFINE_TOLERANCE * size
            self._pattern = None if self._pattern is None else self._pattern | (there != 0.0)
        self._affine = found = _Affine(is_affine, here, offset)
        self._at(x)
        return found


def _gradient_or_zero(total: Tensor, leaf: Tensor, is_kept: bool = False) -> np.ndarray:
    """Zero where the total does not depend on the leaf; is_kept: the graph is needed again."""
    if not total.requires_grad:
        return np.zeros(leaf.shape)
    (gradient,) = torch.autograd.grad(total, leaf, retain_graph=is_kept, allow_unused=True)
    return np.zeros(leaf.shape) if gradient is None else gradient.numpy()


def _disjoint(rows: np.ndarray, pattern: np.ndarray) -> list[list[int]]:
    """Groups of rows no two of which share a variable; the objective, row -1, stays alone."""
    groups: list[list[int]] = [[-1]] if (rows < 0).any() else []
    taken: list[np.ndarray] = [np.ones(pattern.shape[1], dtype=bool) for _ in groups]
    own = rows[rows >= 0]
    for row in own[np.argsort(-pattern[own].sum(axis=1), kind="stable")]:
        for group, columns in zip(groups, taken, strict=True):
            if not (columns & pattern[row]).any():
                group.append(int(row))
                columns |= pattern[row]
                break
        else:
            groups.append([int(row)])
            taken.append(pattern[row].copy())
    return groups


def _parts(items: np.ndarray) -> list[np.ndarray]:
    """Consecutive parts of at most BATCH items."""
    return [items[first : first + BATCH] for first in range(0, len(items), BATCH)]
