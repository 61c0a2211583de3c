"""Bessel functions of the first kind with integer order, to rounding, differentiable to any order.

Two forms share the work for one order. Where x^2 <= 4 (n + 1) the power series loses no digits and ends after few terms. Elsewhere
J_n(x) = 1/N sum over j of cos(n t_j - x sin t_j), t_j = 2 pi j/N, converges faster than any power of 1/N because the
integrand is periodic; for n > x its path is shifted by i acosh(n/x) to the saddle point, where the integrand no longer
cancels, so that even the smallest values keep their digits. A table of all orders at once comes from the recurrence
J_{k-1} + J_{k+1} = 2 k/x J_k, run downwards, where it is stable (Miller). Sources: Abramowitz and Stegun (1964), 9.1.10,
9.1.21 and 9.1.27; Trefethen and Weideman, SIAM Review 56 (2014) on the trapezoidal rule; Watson (1944), section 8.31 on
the saddle point; Gautschi, SIAM Review 9 (1967) on the recurrence.
"""

import math
from typing import Any

import torch
from torch import Tensor

LARGEST_ARGUMENT = 1e4  # of orders and arguments: a rotor of twelve blades at Mach 1 has 120 at the tenth harmonic
VALUES_AT_ONCE = 1 << 18  # elements x points of the sum: bounds its memory
EXTRA_POINTS = 12.0  # J_k(x) < 1e-16 for k > x + 12 (1 + x^(1/3)): Airy's function beyond x, A&S 9.3.4


class _BesselJ(torch.autograd.Function):
    """The derivative (J_{n-1} - J_{n+1})/2 is this function again; the power series gives it along with the value."""

    @staticmethod
    def forward(ctx: Any, order: Tensor, x: Tensor) -> Tensor:
        ctx.save_for_backward(order, x)
        ctx.slope = None
        n, argument = order.double().abs(), x.double().abs()
        # J_-n(x) = J_n(-x) = (-1)^n J_n(x).
        is_negative = (torch.remainder(order, 2) == 1) & ((order < 0) ^ (x < 0))
        is_small = argument**2 <= 4.0 * (n + 1.0)
        if bool(is_small.all()):  # spares copying, and what concerns the order alone is computed once an order
            value, slope = _power_series(n, argument)
            ctx.slope = torch.where(is_negative ^ (x < 0), -slope, slope).to(x.dtype)
        else:
            n, argument = torch.broadcast_tensors(n, argument)
            value = torch.empty_like(argument)
            value[is_small] = _power_series(n[is_small], argument[is_small])[0]
            value[~is_small] = _periodic_sum(n[~is_small], argument[~is_small])
        return torch.where(is_negative, -value, value).to(x.dtype)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, Tensor]:
        order, x = ctx.saved_tensors
        if ctx.slope is not None and not torch.is_grad_enabled():
            return None, (gradient * ctx.slope).sum_to_size(x.shape)
        order = order[(None,) * (x.dim() - order.dim())]
        below, above = bessel_j(torch.stack([order - 1, order + 1]), x)
        return None, (gradient * 0.5 * (below - above)).sum_to_size(x.shape)


def bessel_j(order: Tensor, x: Tensor) -> Tensor:
    """J_order(x), element by element over the broadcast shape; `order` holds integers and carries no gradient.

    x (...,) of either sign; the effort grows with the largest x. Raises ValueError if order plus x exceeds 10 000. Relative error below 1e-12 for orders up to 100, next to zeros of J relative to its amplitude there;
    computed in float64, returned in the type of x. NaN or infinite x gives NaN there and leaves other elements alone.
    """
    value: Tensor = _BesselJ.apply(order, x)  # type: ignore[no-untyped-call]  # torch leaves it without annotations
    return value


def bessel_table(x: Tensor, highest: int) -> Tensor:
    """J_0(x) ... J_highest(x), (..., highest + 1), differentiable to any order; much cheaper than order by order.

    x (...,) at least 0; accuracy, types and NaN as `bessel_j`. Raises ValueError if highest < 0 or x
    exceeds 10 000.
    """
    if highest < 0:
        raise ValueError(f"highest = {highest} is not allowed; it must be at least 0")
    table: Tensor = _BesselTable.apply(x, highest)  # type: ignore[no-untyped-call]  # torch leaves it without annotations
    return table


class _BesselTable(torch.autograd.Function):
    """The derivative J'_k = (J_{k-1} - J_{k+1})/2, J'_0 = -J_1, is a difference within a table one order longer."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, highest: int) -> Tensor:
        ctx.save_for_backward(x)
        ctx.highest = highest
        return _downward_recurrence(x.double(), highest).to(x.dtype)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        (x,) = ctx.saved_tensors
        table = bessel_table(x, ctx.highest + 1)
        slope = torch.cat([-table[..., 1:2], 0.5 * (table[..., :-2] - table[..., 2:])], dim=-1)
        return (gradient * slope).sum(-1), None


def _downward_recurrence(x: Tensor, highest: int) -> Tensor:
    """Ratios J_k/J_{k-1} = x/(2 k - x J_{k+1}/J_k) from an order that is zero downwards, scaled by 1 = J_0 + 2 sum J_2k."""
    x = torch.where(x.isfinite(), x, torch.nan)
    reach = float(x.nan_to_num(0.0).max()) if x.numel() else 0.0
    _require_moderate(reach)
    start = max(highest, math.ceil(reach)) + math.ceil(EXTRA_POINTS * (1.0 + reach ** (1.0 / 3.0)))
    start += start % 2
    ratio, ratios = torch.zeros_like(x), []
    for k in range(start, 0, -1):
        divisor = 2.0 * k - x * ratio
        # A zero of J_{k-1}: the next ratio takes the pole back.
        ratio = x / torch.where(divisor == 0.0, 1e-300, divisor)
        ratios.append(ratio)
    products = torch.cumprod(torch.stack(ratios[::-1], dim=-1), dim=-1)  # J_k/J_0, k = 1 ... start
    first = 1.0 / (1.0 + 2.0 * products[..., 1::2].sum(-1, keepdim=True))
    return torch.cat([first, first * products[..., :highest]], dim=-1)


def _power_series(n: Tensor, x: Tensor) -> tuple[Tensor, Tensor]:
    """J_n(x) = (x/2)^n/n! sum over k of (-x^2/4)^k/(k! (n + 1)_k), for x^2 <= 4 (n + 1), and its derivative."""
    square = 0.25 * x**2
    if square.numel() == 0:
        return square * n, square * n
    # Term k is at most share^k/k!.
    share, terms, largest = float((square / (n + 1.0)).max()), 1, 1.0
    while (largest := largest * share / terms) > 1e-17:
        terms += 1
    k = torch.arange(1, terms + 1, dtype=x.dtype, device=x.device)
    coefficients = torch.cumprod(-1.0 / (k * (n[..., None] + k)), dim=-1).unbind(-1)
    total = coefficients[-1].expand_as(square * n)
    slope = torch.zeros_like(total)
    for coefficient in (*coefficients[-2::-1], torch.ones_like(n)):
        slope = torch.addcmul(total, square, slope)
        total = torch.addcmul(coefficient, square, total)
    # d/dx of (x/2)^n/n! is half of (x/2)^(n-1)/(n-1)!, and nothing for n = 0.
    is_zero = n == 0.0
    below = torch.exp(torch.xlogy(n - 1.0, 0.5 * x) - torch.lgamma(torch.where(is_zero, 1.0, n)))
    below = torch.where(is_zero, 0.0, 0.5 * below)
    power = torch.where(is_zero, 1.0, below * x / torch.where(is_zero, 1.0, n))
    return power * total, torch.addcmul(below * total, power * (0.5 * x), slope)


def _periodic_sum(n: Tensor, x: Tensor) -> Tensor:
    """e^(s - n a) times the mean over t of e^(s (cos t - 1)) cos(n t - x cosh(a) sin t), x cosh(a) = max(n, x)."""
    if x.numel() == 0:
        return x
    x = torch.where(x.isfinite(), x, torch.nan)
    reach = float((n + x).nan_to_num(0.0).max())
    _require_moderate(reach)
    half = math.ceil(0.5 * (reach + EXTRA_POINTS * (1.0 + reach ** (1.0 / 3.0))))
    saddle = torch.sqrt((n**2 - x**2).clamp(min=0.0))  # x sinh(a)
    swing = torch.maximum(n, x)  # x cosh(a)
    angle = torch.arange(half + 1, dtype=x.dtype, device=x.device) * (math.pi / half)
    # The integrand is even in t: half the points, of which the two ends count once.
    weight = torch.full_like(angle, 1.0 / half)
    weight[0] = weight[-1] = 0.5 / half
    sine, fall = torch.sin(angle), torch.cos(angle) - 1.0
    rows = zip(*(part[:, None].split(max(1, VALUES_AT_ONCE // (half + 1))) for part in (n, saddle, swing)), strict=True)
    mean = torch.cat([(torch.exp(s * fall) * torch.cos(k * angle - z * sine)) @ weight for k, s, z in rows])
    # e^-a = x/(n + s); where there is no saddle it is one.
    return mean * torch.exp(saddle + n * torch.log(torch.where(saddle > 0.0, x / (n + saddle), torch.ones_like(x))))


def _require_moderate(reach: float) -> None:
    if reach > LARGEST_ARGUMENT:
        raise ValueError(
            f"argument of a Bessel function = {reach:.4g} is invalid: it must be at most {LARGEST_ARGUMENT:g}"
        )
