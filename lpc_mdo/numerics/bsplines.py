"""B-spline bases: matrices for clamped uniform splines on [0, 1], and the functions that act at a point, for any knots."""

import numpy as np
import torch
from scipy.interpolate import BSpline
from torch import Tensor
from torch.nn.functional import pad


def clamped_knots(count: int, degree: int) -> np.ndarray:
    """Knots (count + degree + 1,) of a spline with `count` control points that starts and ends in its end points.

    Raises ValueError unless count > degree >= 0.
    """
    if not count > degree >= 0:
        raise ValueError(f"degree = {degree} is not allowed; it must lie between 0 and {count - 1} for {count} points")
    inner = np.linspace(0.0, 1.0, count - degree + 1)
    return np.concatenate([np.zeros(degree), inner, np.ones(degree)])


def blade_degree(count: int) -> int:
    """Degree of the splines along a blade with `count` control points: cubic where there are enough."""
    return min(3, count - 1)


def basis_matrix(points: Tensor, count: int, degree: int) -> Tensor:
    """Values (point, count) of the basis functions at `points` (point,) in [0, 1]; each row sums to one."""
    design = BSpline.design_matrix(points.double().numpy(), clamped_knots(count, degree), degree)
    return torch.from_numpy(design.toarray())


def greville_abscissae(count: int, degree: int) -> np.ndarray:
    """Parameters (count,) at which control points on a straight line reproduce it."""
    knots = clamped_knots(count, degree)
    if degree == 0:
        middles: np.ndarray = 0.5 * (knots[1:] + knots[:-1])
        return middles
    return np.array([knots[i + 1 : i + degree + 1].mean() for i in range(count)])


def local_bases(x: Tensor, knots: Tensor, degree: int, order: int = 0) -> tuple[Tensor, Tensor]:
    """The degree + 1 basis functions that act at each x (point,), and their derivatives up to `order`.

    Returns the index (point,) of the first of them, and their values (point, order + 1, degree + 1), differentiable
    with respect to x. knots (count + degree + 1,) do not decrease; x lies between knots[degree] and knots[count]. At an
    interior knot the polynomial to its right is taken. Source: Piegl and Tiller, The NURBS Book (1997), eqs. 2.5, 2.9.
    """
    count = knots.numel() - degree - 1
    span = torch.searchsorted(knots, x.detach().contiguous(), right=True).clamp(degree + 1, count) - 1
    ends = knots[span[:, None] + torch.arange(1 - degree, degree + 1)]  # the 2 degree knots about x
    ladder = [torch.ones(x.numel(), 1, dtype=x.dtype)]
    for p in range(1, degree + 1):  # each degree is a blend of the one below
        lower, upper = ends[:, degree - p : degree], ends[:, degree : degree + p]
        share = ladder[-1] / (upper - lower)
        ladder.append(pad(share * (x[:, None] - lower), (1, 0)) + pad(share * (upper - x[:, None]), (0, 1)))
    values = []
    for derivative in range(order + 1):
        if derivative > degree:
            values.append(torch.zeros_like(ladder[-1]))
            continue
        basis = ladder[degree - derivative]
        for p in range(degree - derivative + 1, degree + 1):  # each derivative is a difference of the degree below
            share = p * basis / (ends[:, degree : degree + p] - ends[:, degree - p : degree])
            basis = pad(share, (1, 0)) - pad(share, (0, 1))
        values.append(basis)
    return span - degree, torch.stack(values, dim=-2)
