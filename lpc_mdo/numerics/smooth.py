"""Smooth stand-ins for functions with kinks, and norms with a gradient at zero."""

import torch
from torch import Tensor


def safe_sqrt(x: Tensor, floor: float = 1e-30) -> Tensor:
    """sqrt(max(x, 0) + floor): finite slope at zero."""
    return torch.sqrt(x.clamp(min=0.0) + floor)


def safe_norm(x: Tensor, dim: int = -1, floor: float = 1e-12) -> Tensor:
    """sqrt(sum x^2 + floor^2) over `dim`: zero gradient at zero instead of none."""
    return torch.sqrt((x**2).sum(dim) + floor**2)


def smooth_step(x: Tensor) -> Tensor:
    """0 below 0, 1 above 1, a fifth-degree polynomial with two continuous derivatives between."""
    t = x.clamp(0.0, 1.0)
    return t**3 * (10.0 + t * (6.0 * t - 15.0))


def smooth_maximum(a: Tensor, b: Tensor, width: float | Tensor) -> Tensor:
    """(a + b + sqrt((a - b)^2 + width^2))/2: above the maximum by at most width/2, where a = b."""
    return 0.5 * (a + b + torch.sqrt((a - b) ** 2 + width**2))


def smooth_minimum(values: Tensor, width: float, dim: int = -1) -> Tensor:
    """-width log sum exp(-values/width) over `dim`: below the minimum by at most width x log of how many there are."""
    return -width * torch.logsumexp(-values / width, dim)
