"""Scales of objective and rows: gradients of about one, whatever the units."""

import numpy as np

from lpc_mdo.optimization.evaluator import Evaluator

SMALL = 1e-3  # gradients that are smaller are scaled up
SCALES = 1e-16, 1e10


def scales(evaluator: Evaluator, x: np.ndarray, curvature: float | None = None) -> tuple[float, np.ndarray]:
    """Scales of objective and rows (m,) for x (n,): gradients larger than one become one, tiny functions are enlarged.

    Tiny is an objective with gradient and `curvature` (the largest second derivative of the scaled Lagrangian, None: not
    known) below SMALL, and a row with a gradient and a distance from its limits below SMALL.
    """
    gradient = evaluator.gradient(x, np.zeros(len(evaluator.constraint_lower))) / evaluator.objective_scale
    slope = float(np.abs(gradient).max(initial=0.0))
    bend = np.inf if curvature is None else curvature / evaluator.objective_scale
    objective = _scale(np.array([slope]), np.array([bend]))[0]
    jacobian = evaluator.jacobian(x) / evaluator.constraint_scale[:, None]
    values = evaluator.values(x)[1] / evaluator.constraint_scale
    lower, upper = evaluator.constraint_lower, evaluator.constraint_upper
    distance = np.minimum(np.abs(values - lower), np.abs(upper - values)) / max(1.0, float(np.abs(x).max(initial=0.0)))
    return float(objective), _scale(np.abs(jacobian).max(axis=1, initial=0.0), distance)


def _scale(slope: np.ndarray, other: np.ndarray) -> np.ndarray:
    """One over the slope where that exceeds one, or over the larger of both where both are tiny; else one."""
    size = np.maximum(slope, other)
    is_tiny = (size < SMALL) & (size > 0.0)
    return np.clip(1.0 / np.where(is_tiny, size, np.maximum(slope, 1.0)), *SCALES)
