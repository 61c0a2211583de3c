"""Roots of scalar equations, batched, with the gradient of the implicit-function theorem."""

from collections.abc import Callable

import torch
from torch import Tensor


class RootNotFoundError(ArithmeticError):
    """A bracketed root did not converge; carries how many elements and their worst residual."""


def implicit_root(
    residual: Callable[..., Tensor],
    lower: Tensor,
    upper: Tensor,
    args: tuple[Tensor, ...],
    initial: Tensor | None = None,
    tolerance: float = 1e-12,
    iterations: int = 100,
) -> Tensor:
    """Element-wise x with residual(x, *args) = 0 in [lower, upper], differentiable with respect to `args`.

    residual acts element by element on tensors that broadcast to the shape (...,) of the bracket, and must be
    negative at `lower` and positive at `upper`. Value: the secant method, started by Newton's, kept inside the shrinking
    bracket, with a bisection wherever it does not halve its step, so it converges for every continuous residual. Gradient: one
    Newton step x - R/R_x is left in the graph; its derivative, -R_p/R_x, is the implicit-function theorem's.

    Elements whose residual is NaN stay NaN and leave the others alone. Raises RootNotFoundError if an element is
    neither NaN nor converged after `iterations`, or ran into an end of a bracket that holds no root.
    """
    with torch.no_grad():
        frozen = tuple(arg.detach() for arg in args)
        x = 0.5 * (lower + upper) if initial is None else torch.minimum(torch.maximum(initial, lower), upper)
        root, slope = _safeguarded_secant(
            residual, lower.detach(), upper.detach(), frozen, x.detach(), tolerance, iterations
        )
    return root - residual(root, *args) / slope


def _value_and_slope(residual: Callable[..., Tensor], x: Tensor, args: tuple[Tensor, ...]) -> tuple[Tensor, Tensor]:
    with torch.enable_grad():
        x = x.detach().requires_grad_()
        value = residual(x, *args)
        (slope,) = torch.autograd.grad(value.sum(), x)
    return value.detach(), slope


def _safeguarded_secant(
    residual: Callable[..., Tensor],
    lower: Tensor,
    upper: Tensor,
    args: tuple[Tensor, ...],
    x: Tensor,
    tolerance: float,
    iterations: int,
) -> tuple[Tensor, Tensor]:
    """Root and dR/dx there."""
    step, ends = upper - lower, (lower, upper)
    value, slope = _value_and_slope(residual, x, args)
    for _ in range(iterations):
        correction = value / slope
        # Near a root rounding keeps the steps from shrinking further: stay there, do not fall back to bisection.
        size = tolerance * (1.0 + x.abs())
        is_done = (value == 0.0) | (correction.abs() <= size) | (upper - lower <= size) | value.isnan()
        if bool(is_done.all()):
            value, slope = _value_and_slope(residual, x, args)
            _require_roots(x, value, value / slope, size, ends)
            return x, slope
        is_above = value > 0.0
        upper = torch.where(is_above, x, upper)
        lower = torch.where(is_above, lower, x)
        target = x - correction
        # Bisect where the step leaves the bracket or is not half the last one.
        is_safe = (target >= lower) & (target <= upper) & (correction.abs() <= 0.5 * step.abs())
        target = torch.where(is_safe, target, 0.5 * (lower + upper))
        target = torch.where(is_done, x, target)
        step = target - x
        previous, value, x = value, residual(target, *args), target
        rise = (value - previous) / step
        slope = torch.where(is_done | (rise <= 0.0) | rise.isnan(), slope, rise)
    worst = float(value[~is_done].abs().max())
    raise RootNotFoundError(f"{int((~is_done).sum())} of {x.numel()} roots did not converge; residual {worst:.3g}")


def _require_roots(x: Tensor, value: Tensor, correction: Tensor, size: Tensor, ends: tuple[Tensor, Tensor]) -> None:
    """Raise RootNotFoundError where the search ended at an end of its first bracket and Newton's method would go on."""
    is_at_end = torch.minimum((x - ends[0]).abs(), (ends[1] - x).abs()) <= 2.0 * size
    is_lost = is_at_end & (correction.abs() > 1e3 * size) & (value != 0.0)
    if bool(is_lost.any()):
        worst = float(value[is_lost].abs().max())
        raise RootNotFoundError(
            f"{int(is_lost.sum())} of {x.numel()} brackets hold no root: the residual must be negative at the lower "
            f"and positive at the upper end; residual {worst:.3g}"
        )
