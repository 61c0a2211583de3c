"""Where a function that bends like a parabola falls through a target, batched."""

from collections.abc import Callable

import torch
from torch import Tensor

from lpc_mdo.numerics.implicit import RootNotFoundError

STEP_TOLERANCE = 1e-6  # of the way: the step taken then leaves its cube
ROUNDINGS = 8.0  # units of the last place that a value may be off
ITERATIONS = 60  # three are usual


@torch.no_grad()
def falling_crossing(
    value: Callable[[Tensor], Tensor],
    slopes: Callable[[Tensor], tuple[Tensor, Tensor]],
    target: Tensor,
    start: Tensor,
    end: Tensor,
    is_searched: Tensor,
    scale: Tensor,
) -> tuple[Tensor, Tensor]:
    """Where `value` falls through `target` (...,) between `start` and `end` (...,), and its slope there, without gradient.

    value(point) element by element, `slopes` its first two derivatives; `scale` (...,) is what rounding is measured by. The
    value must exceed the target at `start` and fall short of it at `end` wherever is_searched (...,); elsewhere the answer is
    `start` and slope one. Each step solves the parabola through value and two derivatives, so that a crossing close to the
    lowest value costs no more than another; steps that leave the bracket halve it instead. Raises RootNotFoundError if that
    does not end.
    """
    point, above, below = start.expand(target.shape), start, end
    rounding = ROUNDINGS * torch.finfo(target.dtype).eps * torch.maximum(scale, target)
    for _ in range(ITERATIONS):
        excess = torch.where(is_searched, value(point) - target, 0.0)
        first, second = slopes(point)
        root = torch.sqrt((first**2 - 2.0 * excess * second).clamp(min=0.0))
        step = torch.where(excess == 0.0, 0.0, -2.0 * excess / (first + torch.copysign(root, first)))
        is_open = (step.abs() > STEP_TOLERANCE * (end - start).abs()) & (excess.abs() > rounding)
        if not bool(is_open.any()):
            return point + step, torch.where(is_searched, first + second * step, 1.0)
        above, below = torch.where(excess > 0.0, point, above), torch.where(excess > 0.0, below, point)
        new = point + step
        is_inside = (new - above) * (new - below) <= 0.0
        point = torch.where(is_open, torch.where(is_inside, new, 0.5 * (above + below)), point)
    worst = float((excess / scale)[is_open].abs().max())
    raise RootNotFoundError(f"{int(is_open.sum())} of {target.numel()} crossings were not found; off by {worst:.3g}")
