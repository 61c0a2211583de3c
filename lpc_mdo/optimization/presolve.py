"""Affine equations of two variables, solved before the solver starts: x_j follows x_i, and both a row and a variable go.

Variables whose bounds are equal go, too.

Symmetry rows x_i = x_j are of this kind. Left to a penalty they would cost iterations and never hold exactly.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.model import Evaluate

NEGLIGIBLE = 1e-9  # of a row's largest coefficient
ON_BOUND = 1e-9


@dataclass(frozen=True)
class Substitution:
    """Row `row` gives x[follower] = factor x[leader] + offset."""

    row: int
    leader: int
    follower: int
    factor: float
    offset: float


@dataclass(frozen=True)
class Presolve:
    """x = factor z[source] + offset, with the variables z and the rows that are left; lower, upper bound z."""

    substitutions: tuple[Substitution, ...]
    variables: np.ndarray  # indices in x of z
    rows: np.ndarray  # indices of the rows left
    source: np.ndarray  # (n,) the entry of z that each variable follows
    factor: np.ndarray  # (n,) zero for a fixed variable
    offset: np.ndarray  # (n,)
    lower: np.ndarray  # (kept,)
    upper: np.ndarray

    def expand(self, z: np.ndarray) -> np.ndarray:
        """x (n,) of z (kept,)."""
        return self.factor * z[self.source] + self.offset if len(z) else self.offset.copy()

    def columns(self, jacobian: np.ndarray) -> np.ndarray:
        """Derivatives (m, kept) in z of rows with derivatives (m, n) in x."""
        columns = np.zeros((len(self.variables), len(jacobian)))
        if len(self.variables):
            np.add.at(columns, self.source, (jacobian * self.factor).T)
        return columns.T

    def expanded(self, z: Tensor) -> Tensor:
        """x (..., n) of z (..., kept)."""
        factor, offset = torch.from_numpy(self.factor), torch.from_numpy(self.offset)
        if z.shape[-1] == 0:
            return offset.expand(*z.shape[:-1], -1)
        return z[..., torch.from_numpy(self.source)] * factor + offset

    def restrict(self, x: np.ndarray) -> np.ndarray:
        """z (kept,) of x (n,), within the bounds of z."""
        return np.clip(x[self.variables], self.lower, self.upper)

    def spread(self, values: np.ndarray, others: np.ndarray | float = 0.0) -> np.ndarray:
        """Values (m,) of all rows: those of the rows left, and `others` for the rows solved."""
        spread = np.zeros(len(self.rows) + len(self.substitutions)) + others
        spread[self.rows] = values
        return spread

    def compose(self, evaluate: Evaluate) -> Evaluate:
        """The same problem as a function of z (..., kept)."""
        rows = torch.from_numpy(self.rows)

        def reduced(z: Tensor) -> tuple[Tensor, Tensor]:
            objective, constraints = evaluate(self.expanded(z))
            return objective, constraints[..., rows]

        return reduced

    def expand_multipliers(self, evaluator: Evaluator, x: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """Scaled multipliers (m,) of all rows at x (n,), from those of the rows left.

        A row that was solved takes up what the Lagrangian's gradient leaves on its follower, or on its leader where only
        the follower is on a bound.
        """
        multipliers = self.spread(kept)
        gradient = evaluator.gradient(x, multipliers)
        jacobian = evaluator.jacobian(x)
        on_bound = (x - evaluator.lower <= ON_BOUND) | (evaluator.upper - x <= ON_BOUND)
        for item in self.substitutions:
            row = jacobian[item.row]
            taker = item.leader if on_bound[item.follower] and not on_bound[item.leader] else item.follower
            multipliers[item.row] = -gradient[taker] / row[taker]
            for index in (item.leader, item.follower):
                gradient[index] += row[index] * multipliers[item.row]
        return multipliers


def presolve(evaluator: Evaluator, x: np.ndarray) -> Presolve:
    """Find the rows that can be solved beforehand; x (n,) is any point."""
    lower, upper = evaluator.lower.copy(), evaluator.upper.copy()
    limits = evaluator.limits[0]
    jacobian, affine = evaluator.jacobian(x), evaluator.rows.affine
    _, values = evaluator.values(x)
    found: dict[int, Substitution] = {}  # by follower
    for row in np.flatnonzero(affine & (evaluator.constraint_lower == evaluator.constraint_upper)):
        size = np.abs(jacobian[row])
        acting = np.flatnonzero(size > NEGLIGIBLE * size.max(initial=0.0))
        if len(acting) != 2 or any(index in found for index in acting):
            continue
        leader, follower = (int(index) for index in acting)
        if any(item.leader == follower for item in found.values()):
            leader, follower = follower, leader
        if any(item.leader == follower for item in found.values()):
            continue
        constant = values[row] - jacobian[row] @ x - limits[row]
        factor, offset = -jacobian[row, leader] / jacobian[row, follower], -constant / jacobian[row, follower]
        ends = sorted((end - offset) / factor for end in (lower[follower], upper[follower]))
        low, high = max(lower[leader], ends[0]), min(upper[leader], ends[1])
        if low > high:
            continue  # left to the solver, which will say so
        lower[leader], upper[leader] = low, high
        found[follower] = Substitution(int(row), leader, follower, factor, offset)
    follows = np.isin(np.arange(len(x)), list(found))
    fixed = np.flatnonzero(~follows & (lower == upper))
    kept = np.flatnonzero(~follows & (lower < upper))
    place = {int(variable): column for column, variable in enumerate(kept)}
    source, factor, offset = np.zeros(len(x), dtype=int), np.zeros(len(x)), np.zeros(len(x))
    source[kept], factor[kept] = np.arange(len(kept)), 1.0
    offset[fixed] = lower[fixed]
    for item in found.values():
        offset[item.follower] = item.offset
        if item.leader in place:
            source[item.follower], factor[item.follower] = place[item.leader], item.factor
        else:
            offset[item.follower] += item.factor * lower[item.leader]
    solved = {item.row for item in found.values()}
    rows = np.array([i for i in range(len(limits)) if i not in solved], dtype=int)
    return Presolve(tuple(found.values()), kept, rows, source, factor, offset, lower[kept], upper[kept])
