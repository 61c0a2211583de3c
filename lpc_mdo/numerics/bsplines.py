"""Clamped uniform B-splines on [0, 1] as basis matrices."""

import numpy as np
import torch
from scipy.interpolate import BSpline
from torch import Tensor


def clamped_knots(count: int, degree: int) -> np.ndarray:
    """Knots (count + degree + 1,) of a spline with `count` control points that starts and ends in its end points.

    Raises ValueError unless count > degree >= 0.
    """
    if not count > degree >= 0:
        raise ValueError(f"degree = {degree} is not allowed; it must lie between 0 and {count - 1} for {count} points")
    inner = np.linspace(0.0, 1.0, count - degree + 1)
    return np.concatenate([np.zeros(degree), inner, np.ones(degree)])


def basis_matrix(points: Tensor, count: int, degree: int) -> Tensor:
    """Values (point, count) of the basis functions at `points` (point,) in [0, 1]; each row sums to one."""
    design = BSpline.design_matrix(points.double().numpy(), clamped_knots(count, degree), degree)
    return torch.from_numpy(design.toarray())


def greville_abscissae(count: int, degree: int) -> np.ndarray:
    """Parameters (count,) at which control points on a straight line reproduce it."""
    knots = clamped_knots(count, degree)
    if degree == 0:
        return 0.5 * (knots[1:] + knots[:-1])
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(count)])
