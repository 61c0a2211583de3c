"""Gradients of a problem's rows: those of affine rows once, the others in a few batches."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from lpc_mdo.optimization.model import Model, Point, gradient_or_zero, parts

AFFINE_TOLERANCE = 1e-10
SUM_TOLERANCE = 1e-9  # relative, of gradients of sums of rows with sums of their gradients


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
class RowGradients:
    """Unscaled gradients of the rows, kept with the model's point.

    Rows whose gradients agree at two points within the bounds are taken as affine and checked against their linear form at
    every later evaluation. is_batched: rows that share no variable are differentiated as one sum, all sums by one evaluation
    of copies of the point (Curtis, Powell and Reid 1974, by rows); a product of the whole Jacobian checks each time that they
    share none.
    """

    model: Model
    lower: np.ndarray  # (n,)
    upper: np.ndarray
    is_batched: bool
    _affine: _Affine | None = None
    _pattern: np.ndarray | None = None  # (m, n) where gradients of rows were not zero

    @property
    def affine(self) -> np.ndarray:
        """Mask (m,) of the rows known to be affine, once a Jacobian has been asked for."""
        return np.zeros(self.model.size, dtype=bool) if self._affine is None else self._affine.rows.copy()

    def inherit(
        self, whole: "RowGradients", rows: np.ndarray, columns: Callable[[np.ndarray], np.ndarray], offset: np.ndarray
    ) -> None:
        """Take over which rows of `whole` are affine; columns: from derivatives in its x to those in the z of x = ... + offset."""
        known = whole._affine
        if known is not None:
            jacobian = known.jacobian[rows]
            self._affine = _Affine(known.rows[rows], columns(jacobian), known.offset[rows] + jacobian @ offset)
        if whole._pattern is not None:  # with numbers that do not cancel
            self._pattern = columns(np.where(whole._pattern[rows], np.sqrt(np.arange(2, len(offset) + 2)), 0.0)) != 0.0

    def at(self, x: np.ndarray) -> Point:
        """The model's point x (n,); affine rows are checked where it is a new one."""
        is_new = not self.model.is_at(x)
        point = self.model.at(x)
        if is_new and point.is_finite and self._affine is not None:
            self._affine.check(x, point.constraints.detach().numpy())
        return point

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """(m, n) at x (n,)."""
        affine = self._affine or self._find_affine(x)
        point = self.at(x)
        if point.jacobian is None:
            jacobian = affine.jacobian.copy()
            curved = np.flatnonzero(~affine.rows)
            jacobian[curved] = self._of_rows(x, curved)
            point.jacobian = jacobian
        return point.jacobian

    def with_objective(self, x: np.ndarray) -> None:
        """Keep the Jacobian and the objective's gradient at x (n,), found in one batch, with the model's point."""
        affine = self._affine or self._find_affine(x)
        point = self.at(x)
        if point.slope is not None:
            return
        curved = np.flatnonzero(~affine.rows)
        found = self._of_copies(x, np.append(-1, curved))
        point.jacobian = affine.jacobian.copy()
        point.jacobian[curved], point.slope = found[1:], found[0]

    def _of_rows(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Gradients (row, n) of the given rows."""
        if self.is_batched and len(rows) > 1:
            return self._of_copies(x, rows)
        point = self.at(x)
        jacobian = np.zeros((len(rows), len(x)))
        for i, row in enumerate(rows):
            jacobian[i] = gradient_or_zero(point.constraints[row], point.x, is_kept=True)
        self.model.counts.gradients += len(rows)
        return jacobian

    def _of_copies(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """As `_of_rows`, row -1 the objective: one copy of the point for every group of rows, one backward pass for all."""
        pattern = self._pattern
        if pattern is None:
            return self._one_by_one(x, rows)
        groups, found = _disjoint(rows, pattern), np.zeros((len(rows), len(x)))
        place = {int(row): i for i, row in enumerate(rows)}
        for part in parts(np.arange(len(groups))):
            of_part = [groups[i] for i in part]
            for group, gradient in zip(of_part, self._sums_of_copies(x, of_part), strict=True):
                for row in group:
                    found[place[row]] = gradient if len(group) == 1 else np.where(pattern[row], gradient, 0.0)
        if len(groups) < len(rows) and not self._adds_up(x, rows, found):  # rows share variables that they did not
            found = self._one_by_one(x, rows)
            pattern[rows[rows >= 0]] |= found[rows >= 0] != 0.0
        return found

    def _one_by_one(self, x: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Gradients (row, n) of rows, a copy for each."""
        groups = [[int(row)] for row in rows]
        of_parts = [[groups[i] for i in part] for part in parts(np.arange(len(groups)))]
        return np.concatenate([self._sums_of_copies(x, part) for part in of_parts])

    def _sums_of_copies(self, x: np.ndarray, groups: list[list[int]]) -> np.ndarray:
        """Gradients (group, n) of sums of rows."""
        copies, objective, constraints = self.model.at_all(np.repeat(x[None], len(groups), axis=0))
        pairs = [(i, row) for i, group in enumerate(groups) for row in group if row >= 0]
        total = constraints[tuple(torch.tensor(pairs).T)].sum() if pairs else constraints.sum() * 0.0
        of_objective = [i for i, group in enumerate(groups) if group == [-1]]
        if of_objective:
            total = total + objective[of_objective].sum()
        return gradient_or_zero(total, copies)

    def _adds_up(self, x: np.ndarray, rows: np.ndarray, found: np.ndarray) -> bool:
        """Whether a weighted sum of the rows has the gradient that theirs give."""
        is_row = rows >= 0
        wave, weights = np.cos(np.arange(1, len(rows) + 1)), np.zeros(self.model.size)
        weights[rows[is_row]] = wave[is_row]
        point = self.at(x)
        shown = gradient_or_zero((point.constraints * torch.from_numpy(weights)).sum(), point.x, is_kept=True)
        self.model.counts.gradients += 1
        size = np.abs(wave[is_row]) @ np.abs(found[is_row])
        return bool((np.abs(shown - wave[is_row] @ found[is_row]) <= SUM_TOLERANCE * (1.0 + size)).all())

    def _find_affine(self, x: np.ndarray) -> _Affine:
        rows = np.arange(self.model.size)
        here = self._of_rows(x, rows)
        offset = self.at(x).constraints.detach().numpy() - here @ x
        wave = 0.01 * np.cos(np.arange(1, len(x) + 1))  # any fixed direction that favours no variable
        moved = np.clip(x + wave, self.lower, self.upper)
        if not self.at(moved).is_finite:
            is_affine = np.zeros(len(rows), dtype=bool)
        else:
            self._pattern = here != 0.0
            there = self._of_rows(moved, rows)
            size = 1.0 + np.abs(here).max(axis=1, initial=0.0)
            is_affine = np.abs(there - here).max(axis=1, initial=0.0) <= AFFINE_TOLERANCE * size
            self._pattern = None if self._pattern is None else self._pattern | (there != 0.0)
        self._affine = found = _Affine(is_affine, here, offset)
        self.at(x)
        return found


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
