"""Newton's steps of many searches side by side, each for the least distance within a box of two parameters."""

from collections.abc import Iterator
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class State:
    """Where each of the searches stands; first and second derivatives of half the squared distance."""

    x: Tensor  # (search, 2)
    value: Tensor  # (search,) m^2
    gradient: Tensor  # (search, 2)
    hessian: Tensor  # (search, 3): uu, uv, vv
    metric: Tensor  # (search, 2) squared length of the tangents
    residual: Tensor  # (search,) m

    def where(self, mask: Tensor, other: "State") -> "State":
        pairs = zip(self, other, strict=True)
        return State(*(torch.where(mask.reshape(-1, *[1] * (a.dim() - 1)), a, b) for a, b in pairs))

    def take(self, index: Tensor) -> "State":
        return State(*(item[index] for item in self))

    def put(self, index: Tensor, other: "State") -> None:
        for item, values in zip(self, other, strict=True):
            item[index] = values

    def __iter__(self) -> Iterator[Tensor]:
        return (getattr(self, name) for name in self.__annotations__)


def held(x: Tensor, gradient: Tensor, low: Tensor, high: Tensor) -> Tensor:
    """Where a bound (search, 2) stops the descent."""
    return ((x <= low) & (gradient >= 0.0)) | ((x >= high) & (gradient <= 0.0))


def newton_step(state: State, box: tuple[Tensor, Tensor], damping: Tensor) -> Tensor:
    """Newton's step (search, 2) in tangents of unit length, made a descent by a shift of the Hessian.

    At most a quarter of the box.
    """
    low, high = box
    is_free = ~held(state.x, state.gradient, low, high)
    scale = torch.sqrt(state.metric + 1e-30 * state.metric.amax(-1, keepdim=True) + 1e-300)
    gradient = torch.where(is_free, state.gradient / scale, 0.0)
    a = torch.where(is_free[:, 0], state.hessian[:, 0] / scale[:, 0] ** 2, 1.0)
    c = torch.where(is_free[:, 1], state.hessian[:, 2] / scale[:, 1] ** 2, 1.0)
    b = torch.where(is_free.all(-1), state.hessian[:, 1] / scale.prod(-1), 0.0)
    half, radius = 0.5 * (a + c), torch.sqrt(0.25 * (a - c) ** 2 + b**2)
    least, largest = half - radius, half.abs() + radius
    shift = torch.where(least > 0.0, 0.0, 1e-3 * largest - least) + damping * largest + 1e-300
    a, c = a + shift, c + shift
    step = -torch.stack([c * gradient[:, 0] - b * gradient[:, 1], a * gradient[:, 1] - b * gradient[:, 0]], dim=-1)
    step = step / (a * c - b * b)[:, None] / scale
    excess = (step.abs() / (0.25 * (high - low))).amax(-1, keepdim=True)
    return step / excess.clamp(min=1.0)


def smooth_box(x: Tensor, breaks: Tensor) -> tuple[Tensor, Tensor]:
    """Ends (search,) of the range about x in which the surface has a continuous tangent.

    A knot belongs to the polynomial on its right: the range on its left ends one number before it.
    """
    span = torch.searchsorted(breaks, x.contiguous(), right=True).clamp(1, breaks.numel() - 1)
    low, high = breaks[span - 1], breaks[span]
    return low, torch.where(span < breaks.numel() - 1, torch.nextafter(high, low), high)


def breaks_of(knots: Tensor, degree: int, count: int) -> Tensor:
    """Both ends, and the knots at which the tangent may jump."""
    values, times = torch.unique(knots[degree : count + 1], return_counts=True)
    is_break = times >= max(degree, 1)
    is_break[0] = is_break[-1] = True
    return values[is_break]
