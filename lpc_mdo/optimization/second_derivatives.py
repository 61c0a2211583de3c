"""Second derivatives along a search of Newton's method: exact at every point, or exact now and then and improved by steps.

An exact matrix costs a gradient for each variable; what a step shows of it (symmetric rank one) costs nothing. In between,
more steps are needed. Source: Nocedal and Wright, Numerical Optimization (2006), ch. 6.
"""

from dataclasses import dataclass

import numpy as np

from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.quadratic import is_free

SAFE_UPDATE = 1e-8  # of |r| |s|: smaller denominators are left out of the rank-one update
HELPFUL = 0.5  # a step that leaves more of the certificate's merit than this does not help
PATIENCE = 3  # steps in a row that do not help, before second derivatives are exact again


@dataclass
class SecondDerivatives:
    """Of the scaled Lagrangian at the points of one search, improved by steps where the evaluator is thrifty."""

    evaluator: Evaluator
    is_exact: bool = False  # what was given last
    _matrix: np.ndarray | None = None  # (n, n), and where it belongs, with first derivatives there:
    _x: np.ndarray | None = None
    _gradient: np.ndarray | None = None
    _jacobian: np.ndarray | None = None
    _merit: float = np.inf
    _unhelpful: int = 0

    def at(self, x: np.ndarray, multipliers: np.ndarray, merit: float) -> np.ndarray:
        """(n, n) at x (n,) for multipliers (m,), where the certificate has this merit.

        Raises ArithmeticError where the model fails beside x.
        """
        self._unhelpful = 0 if merit <= HELPFUL * self._merit else self._unhelpful + 1
        self._merit = merit
        if self._x is None or self._unhelpful >= PATIENCE:
            return self.exact(x, multipliers, merit)
        gradient, jacobian = self._first(x)
        step = x - self._x
        change = gradient - self._gradient + (jacobian - self._jacobian).T @ multipliers
        self._x, self._gradient, self._jacobian = x, gradient, jacobian
        self._matrix, self.is_exact = _rank_one(self._matrix, step, change), False
        return self._matrix

    def exact(self, x: np.ndarray, multipliers: np.ndarray, merit: float) -> np.ndarray:
        """As `at`, by the evaluator; of a thrifty one for the variables alone that no bound holds."""
        self._merit, self._unhelpful, self.is_exact = merit, 0, True
        if not (self.evaluator.is_thrifty and self.evaluator.is_batched):
            self._matrix = self.evaluator.hessian(x, multipliers)
        else:
            self._x, (self._gradient, self._jacobian) = x, self._first(x)
            free = is_free(self.evaluator, x, self._gradient + self._jacobian.T @ multipliers)
            self._matrix = self.evaluator.free_hessian(x, multipliers, free)
        return self._matrix

    def _first(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Gradient (n,) of the objective and Jacobian (m, n)."""
        self.evaluator.differentiate(x)
        return self.evaluator.gradient(x, np.zeros(len(self.evaluator.constraint_lower))), self.evaluator.jacobian(x)


def _rank_one(matrix: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """The nearest symmetric matrix, but for a term of rank one, with matrix @ step = change."""
    missing = change - matrix @ step
    product = float(missing @ step)
    if abs(product) <= SAFE_UPDATE * float(np.linalg.norm(missing) * np.linalg.norm(step)):
        return matrix
    return matrix + np.outer(missing, missing) / product
