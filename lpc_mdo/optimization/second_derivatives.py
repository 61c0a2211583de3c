"""Second derivatives along a search of Newton's method: exact at every point, or exact now and then and improved by steps.

An exact matrix costs a gradient for each variable; what a step shows of it (symmetric rank one) costs nothing. In between,
more steps are needed. Source: Nocedal and Wright, Numerical Optimization (2006), ch. 6.
"""

from dataclasses import dataclass

import numpy as np

from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.functions import Functions
from lpc_mdo.optimization.quadratic import is_free

SAFE_UPDATE = 1e-8  # of |r| |s|: smaller denominators are left out of the rank-one update
HELPFUL = 0.5  # a step that leaves more of the certificate's merit than this does not help
PATIENCE = 3  # steps in a row that do not help, before second derivatives are exact again


@dataclass(frozen=True)
class _Kept:
    """A matrix (n, n), and where it belongs, with first derivatives there."""

    matrix: np.ndarray
    x: np.ndarray  # (n,)
    gradient: np.ndarray  # (n,)
    jacobian: np.ndarray  # (m, n)


@dataclass
class SecondDerivatives:
    """Of the scaled Lagrangian at the points of one search, improved by steps where the evaluator is thrifty."""

    evaluator: Functions
    is_exact: bool = False  # what was given last
    _last: _Kept | None = None
    _merit: float = np.inf
    _unhelpful: int = 0

    def at(self, x: np.ndarray, multipliers: np.ndarray, merit: float) -> np.ndarray:
        """(n, n) at x (n,) for multipliers (m,), where the certificate has this merit.

        Raises ArithmeticError where the model fails beside x.
        """
        self._unhelpful = 0 if merit <= HELPFUL * self._merit else self._unhelpful + 1
        self._merit = merit
        last, thrifty = self._last, self._thrifty
        if last is None or thrifty is None or self._unhelpful >= PATIENCE:
            return self.exact(x, multipliers, merit)
        gradient, jacobian = _first(thrifty, x)
        change = gradient - last.gradient + (jacobian - last.jacobian).T @ multipliers
        matrix = _rank_one(last.matrix, x - last.x, change)
        self._last, self.is_exact = _Kept(matrix, x, gradient, jacobian), False
        return matrix

    def exact(self, x: np.ndarray, multipliers: np.ndarray, merit: float) -> np.ndarray:
        """As `at`, by the evaluator; of a thrifty one for the variables alone that no bound holds."""
        self._merit, self._unhelpful, self.is_exact = merit, 0, True
        thrifty = self._thrifty
        if thrifty is None:
            return self.evaluator.hessian(x, multipliers)
        gradient, jacobian = _first(thrifty, x)
        free = is_free(thrifty, x, gradient + jacobian.T @ multipliers)
        matrix = thrifty.free_hessian(x, multipliers, free)
        self._last = _Kept(matrix, x, gradient, jacobian)
        return matrix

    @property
    def _thrifty(self) -> Evaluator | None:
        evaluator = self.evaluator
        return evaluator if isinstance(evaluator, Evaluator) and evaluator.is_thrifty and evaluator.is_batched else None


def _first(evaluator: Evaluator, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (n,) of the objective and Jacobian (m, n)."""
    evaluator.differentiate(x)
    return evaluator.gradient(x, np.zeros(len(evaluator.constraint_lower))), evaluator.jacobian(x)


def _rank_one(matrix: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The nearest symmetric matrix, but for a term of rank one, with matrix @ step = change."""
    missing = change - matrix @ step
    product = float(missing @ step)
    if abs(product) <= SAFE_UPDATE * float(np.linalg.norm(missing) * np.linalg.norm(step)):
        return matrix
    return matrix + np.outer(missing, missing) / product
