"""What Newton's method, restoration and the certificate ask of a problem: an Evaluator, or the elastic form of one."""

from typing import Protocol

import numpy as np

from lpc_mdo.optimization.evaluator import Counts


class Functions(Protocol):
    """Scaled objective and rows of x (n,) with their derivatives; as `Evaluator` has them."""

    lower: np.ndarray
    upper: np.ndarray

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled limits (m,) of the rows."""
        ...

    @property
    def counts(self) -> Counts: ...

    @property
    def curvature_noise(self) -> float:
        """Of second derivatives, relative to the largest."""
        ...

    def is_finite(self, x: np.ndarray, /) -> bool: ...

    def values(self, x: np.ndarray, /) -> tuple[float, np.ndarray]: ...

    def gradient(self, x: np.ndarray, /, weights: np.ndarray, objective_weight: float = 1.0) -> np.ndarray: ...

    def jacobian(self, x: np.ndarray, /) -> np.ndarray: ...

    def hessian(self, x: np.ndarray, /, multipliers: np.ndarray, objective_weight: float = 1.0) -> np.ndarray: ...
