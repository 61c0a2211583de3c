"""Roots of scalar equations, batched, with the gradient of the implicit-function theorem."""

import math
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

NARROW = 1e-12  # width of a bracket that needs no further search


class RootNotFoundError(ArithmeticError):
    """A bracketed root did not converge; carries how many elements and their worst residual."""


def implicit_root(
    residual: Callable[..., Tensor],
    lower: Tensor,
    upper: Tensor,
    args: tuple[Tensor, ...],
    initial: Tensor | None = None,
    initial_slope: Tensor | None = None,
    tolerance: float = 1e-12,
    iterations: int = 100,
) -> Tensor:
    """Element-wise x with residual(x, *args) = 0 in [lower, upper], differentiable with respect to `args`.

    Value: `find_root`. Gradient: `with_implicit_gradient`. Raises RootNotFoundError as `find_root`.
    """
    root = find_root(residual, lower, upper, args, initial, initial_slope, tolerance, iterations)
    return with_implicit_gradient(residual, root, args)


@torch.no_grad()
def find_root(
    residual: Callable[..., Tensor],
    lower: Tensor,
    upper: Tensor,
    args: tuple[Tensor, ...],
    initial: Tensor | None = None,
    initial_slope: Tensor | None = None,
    tolerance: float = 1e-12,
    iterations: int = 100,
) -> Tensor:
    """Element-wise x with residual(x, *args) = 0 in [lower, upper], without gradient.

    residual acts element by element on tensors that broadcast to the shape (...,) of the bracket, and must be
    negative at `lower` and positive at `upper`. A first step by Newton's method, or by an estimate `initial_slope`
    (...,) of R_x at the first guess `initial`, which spares its evaluation; then steps by the slope of the parabola through
    the last three points, kept inside the shrinking bracket. Where steps do not halve within two, the next goes twice as far
    as the last, at most to the middle of the bracket, so it converges for every continuous residual. tolerance is relative
    to 1 + |x| and not finer than four times the precision of x. What is found for an element depends on no other.

    Elements whose residual is NaN stay NaN and leave the others alone. Raises RootNotFoundError if an element is
    neither NaN nor converged after `iterations`, or ran into an end of a bracket that holds no root.
    """
    frozen = tuple(arg.detach() for arg in args)
    lower, upper = torch.broadcast_tensors(lower.detach(), upper.detach())
    x = 0.5 * (lower + upper) if initial is None else torch.minimum(torch.maximum(initial, lower), upper)
    tolerance = max(tolerance, 4.0 * torch.finfo(lower.dtype).eps)
    x = x.detach()
    if initial_slope is None:
        value, slope = _value_and_slope(residual, x, frozen)
        last_rise = slope
    else:
        value, slope = residual(x, *frozen), initial_slope
        last_rise = torch.full_like(x, math.nan)  # an estimate is no chord to lay a parabola through
    return _bracketed_root(residual, (lower, upper), frozen, (x, value, slope, last_rise), tolerance, iterations)


def with_implicit_gradient(residual: Callable[..., Tensor], root: Tensor, args: tuple[Tensor, ...]) -> Tensor:
    """The root (...,) with the gradient -R_p/R_x of the implicit-function theorem with respect to `args`.

    Evaluated in the backward pass, and itself differentiable any number of times; args broadcast to the root.
    """
    expanded = (arg.expand(root.shape) for arg in args)
    passed: Tensor = _ImplicitRoot.apply(residual, root, *expanded)  # type: ignore[no-untyped-call]  # torch leaves it without annotations
    return passed


class _ImplicitRoot(torch.autograd.Function):
    """Passes the root on; args have its shape, so that one pass back gives R_x and every R_p element by element."""

    @staticmethod
    def forward(ctx: Any, residual: Callable[..., Tensor], root: Tensor, *args: Tensor) -> Tensor:
        x = root.clone()
        ctx.residual, ctx.partials = residual, None
        ctx.save_for_backward(x, *args)
        return x

    @staticmethod
    def backward(ctx: Any, by_root: Tensor) -> tuple[Tensor | None, ...]:
        is_needed = ctx.needs_input_grad[2:]
        is_again = torch.is_grad_enabled()
        if is_again or ctx.partials is None:
            # Views keep the partial derivatives apart: the root itself depends on the args.
            x, *args = (v.view_as(v) if is_again else v.detach().requires_grad_() for v in ctx.saved_tensors)
            with torch.enable_grad():
                value = ctx.residual(x, *args)
                wanted = [x, *(arg for arg, is_wanted in zip(args, is_needed, strict=True) if is_wanted)]
                partials = torch.autograd.grad(value.sum(), wanted, create_graph=is_again, materialize_grads=True)
            if not is_again:  # rows of a Jacobian share them
                ctx.partials = partials
        else:
            partials = ctx.partials
        pull, found = -by_root / partials[0], iter(partials[1:])
        return None, None, *(pull * next(found) if is_wanted else None for is_wanted in is_needed)


def _value_and_slope(residual: Callable[..., Tensor], x: Tensor, args: tuple[Tensor, ...]) -> tuple[Tensor, Tensor]:
    with torch.enable_grad():
        x = x.detach().requires_grad_()
        value = residual(x, *args)
        (slope,) = torch.autograd.grad(value.sum(), x)
    return value.detach(), slope


def _bracketed_root(
    residual: Callable[..., Tensor],
    ends: tuple[Tensor, Tensor],
    args: tuple[Tensor, ...],
    start: tuple[Tensor, Tensor, Tensor, Tensor],
    tolerance: float,
    iterations: int,
) -> Tensor:
    """Root between the ends from a start: point, residual, slope to step by, slope to take for the chord before."""
    (lower, upper), (x, value, slope, rise) = ends, start
    step = last_step = upper - lower
    back = torch.zeros_like(x)
    for _ in range(iterations):
        correction = value / slope
        # Near a root rounding keeps the steps from shrinking further: stay there, do not fall back to bisection.
        size = tolerance * (1.0 + x.abs())
        width = upper - lower
        is_last = (correction.abs() <= size) | value.isnan()
        is_done = is_last | (value == 0.0) | (width <= size.clamp(max=NARROW))
        if bool(is_done.all()):
            _require_roots(x, value, correction, size, ends)
            return torch.where(is_last, x - correction, x)
        is_above = value > 0.0
        upper = torch.where(is_above, x, upper)
        lower = torch.where(is_above, lower, x)
        target = x - correction
        # As Brent's method: a step that leaves the bracket or is not half the last but one is not trusted.
        is_safe = (target >= lower) & (target <= upper) & (correction.abs() <= 0.5 * last_step.abs())
        reach = torch.minimum(0.5 * (upper - lower), 2.0 * step.abs())
        target = torch.where(is_safe, target, torch.where(is_above, x - reach, x + reach))
        target = torch.where(is_done, x, target)
        last_step, step = step, target - x
        previous, value, x = value, residual(target, *args), target
        last_rise, rise = rise, (value - previous) / step
        parabola = rise + (rise - last_rise) * step / (step + back)
        back = step
        # Where the residual falls no slope leads to its root: zero makes the next step one that is not trusted, which grows.
        fallback = torch.where(is_done, slope, 0.0)
        slope = torch.where(parabola > 0.0, parabola, torch.where(rise > 0.0, rise, fallback))
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
