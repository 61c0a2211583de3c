"""The positive root of h + c h^n = 1: motors' least currents and saturated magnetic circuits both come down to it."""

from typing import Any

import torch
from torch import Tensor

LARGEST_EXPONENT = 20
ITERATIONS = 8  # of Newton's method; from the start below seven reach rounding for every c and n up to 20


class _TrinomialRoot(torch.autograd.Function):
    """Newton's method; the derivative dh/dc = -h^n/(1 + n c h^(n-1)) knows nothing of the iterations."""

    @staticmethod
    def forward(ctx: Any, coefficient: Tensor, exponent: int) -> Tensor:
        # Exact for small and for large c; the polynomial is convex, so that from the second step on h falls to the root.
        h = (1.0 + torch.sqrt(coefficient)) ** (-2.0 / exponent)
        for _ in range(ITERATIONS):
            slope = coefficient * h ** (exponent - 1)
            h = (1.0 + (exponent - 1) * slope * h) / (1.0 + exponent * slope)
        ctx.save_for_backward(coefficient, h)
        ctx.exponent = exponent
        return h

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        coefficient, h = ctx.saved_tensors
        power = h ** (ctx.exponent - 1)
        return -gradient * power * h / (1.0 + ctx.exponent * coefficient * power), None


def trinomial_root(coefficient: Tensor, exponent: int) -> Tensor:
    """h (...,) between 0 and 1 with h + coefficient h^exponent = 1, to rounding, differentiable to any order.

    coefficient (...,) at least 0, exponent between 2 and 20; NaN, or a negative coefficient, gives NaN there and leaves other
    elements alone. Raises ValueError for other exponents.
    """
    if not 2 <= exponent <= LARGEST_EXPONENT:
        raise ValueError(f"exponent = {exponent} is not allowed; it must lie between 2 and {LARGEST_EXPONENT}")
    root: Tensor = _TrinomialRoot.apply(coefficient, exponent)  # type: ignore[no-untyped-call]  # torch leaves it without annotations
    return root
