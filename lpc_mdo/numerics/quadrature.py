"""Gauss-Legendre quadrature between the knots of a spline."""

import numpy as np
import torch
from torch import Tensor


def gauss_legendre(breaks: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Nodes and weights, each ((breaks - 1) count,), of `count` points between any two of the increasing breaks.

    Exact for piecewise polynomials of degree 2 count - 1. Raises ValueError unless count >= 1.
    """
    if count < 1:
        raise ValueError(f"count = {count} is not allowed; it must be at least 1")
    nodes, weights = (torch.from_numpy(part) for part in np.polynomial.legendre.leggauss(count))
    half = 0.5 * (breaks[1:] - breaks[:-1])[:, None]
    middle = 0.5 * (breaks[1:] + breaks[:-1])[:, None]
    return (middle + half * nodes).flatten(), (half * weights).flatten()
