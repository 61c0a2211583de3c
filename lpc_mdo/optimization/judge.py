"""The verdict on a point that some other search has found."""

import numpy as np

from lpc_mdo.optimization.certificate import LARGE, certify
from lpc_mdo.optimization.curvature import curves_downward
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.large import fault_large
from lpc_mdo.optimization.quadratic import SNAPPED, quadratic_model
from lpc_mdo.optimization.verdict import DOWNHILL, Fault, fault, missing, remainder


def fault_at(
    evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray, tolerances: tuple[float, float]
) -> Fault | None:
    """Why x (n,) with scaled multipliers (m,) is no optimum, as our own solvers judge theirs; None where it is one."""
    certificate = certify(evaluator, x, multipliers)
    if not certificate.holds(*tolerances):
        return missing(certificate, tolerances)
    if len(x) > LARGE:
        return fault_large(evaluator, x, multipliers, tolerances)
    x = _on_bounds(evaluator, x, multipliers)
    try:
        model = quadratic_model(evaluator, x, multipliers)
    except ArithmeticError:
        return Fault("second derivatives are not finite there")
    left = remainder(evaluator, x, multipliers, model)
    return fault(multipliers, certificate, model, left, tolerances) or (
        DOWNHILL if curves_downward(evaluator, x, model) else None
    )


def _on_bounds(evaluator: Evaluator, x: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """The point with variables on the bounds that hold them: some searches end a hair before them."""
    pressure = evaluator.gradient(x, multipliers)
    below, above = x - evaluator.lower, evaluator.upper - x
    x = np.where((below <= SNAPPED) & (pressure > below), evaluator.lower, x)
    return np.where((above <= SNAPPED) & (-pressure > above), evaluator.upper, x)
