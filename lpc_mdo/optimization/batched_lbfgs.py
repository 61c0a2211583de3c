"""L-BFGS within bounds for many functions at once, each with its own memory, step length and end.

Two-metric projection: variables on a bound that the slope presses against stay, the others follow the two-loop recursion,
and the step is bent along the bounds. Sources: Bertsekas, SIAM J. Control Optim. 20 (1982); Nocedal, Math. Comp. 35 (1980).
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

BatchFunction = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""Points (b, n) and which function (b,) each belongs to, to values (b,) and gradients (b, n); NaN where one fails."""

MEMORY = 10
SUFFICIENT = 1e-4  # share of the slope's promise that a step must keep
LEAST_CURVATURE = 1e-10  # of |s| |y|: pairs that curve less are not remembered
SHRINK = 0.1, 0.5  # a rejected step is shortened to between these shares
SMALLEST_STEP = 1e-12


@dataclass
class _State:
    """All functions; the first dimension is the function, pairs run from the oldest to the newest."""

    x: Tensor  # (k, n)
    value: Tensor  # (k,)
    gradient: Tensor  # (k, n)
    steps: Tensor  # (k, memory, n)
    changes: Tensor  # (k, memory, n) of the gradient
    direction: Tensor  # (k, n)
    length: Tensor  # (k,)


def minimize_in_boxes(
    function: BatchFunction, x: Tensor, lower: Tensor, upper: Tensor, tolerance: Tensor, evaluations: int
) -> tuple[Tensor, Tensor]:
    """Minimize each of k functions from x (k, n) within its bounds (k, n).

    A function is done when its projected gradient is within its tolerance (k,), after so many evaluations, or where no step
    helps any more; it then leaves the batch. Returns x (k, n) and the number of accepted steps (k,).
    """
    everyone = torch.arange(len(x))
    value, gradient = function(x, everyone)
    pairs = x.new_zeros(len(x), MEMORY, x.shape[1])
    state = _State(x.clone(), value, gradient, pairs, pairs.clone(), torch.zeros_like(x), torch.ones_like(value))
    accepted = torch.zeros(len(x), dtype=torch.long)
    active = _unfinished(state, everyone, lower, upper, tolerance)
    _turn(state, active, lower, upper)
    for _ in range(evaluations):
        if len(active) == 0:
            break
        reached = state.x[active] + state.length[active, None] * state.direction[active]
        trial = torch.maximum(torch.minimum(reached, upper[active]), lower[active])
        value, gradient = function(trial, active)
        promise = (state.gradient[active] * (trial - state.x[active])).sum(-1)
        is_better = value.isfinite() & (value <= state.value[active] + SUFFICIENT * promise)
        taken, refused = active[is_better], active[~is_better]
        _take(state, taken, trial[is_better], value[is_better], gradient[is_better])
        accepted[taken] += 1
        state.length[refused] *= _shrinkage(state.value[refused], value[~is_better], promise[~is_better])
        going = taken[torch.isin(taken, _unfinished(state, taken, lower, upper, tolerance))]
        _turn(state, going, lower, upper)
        hopeful = refused[state.length[refused] > SMALLEST_STEP]
        active = torch.cat([going, hopeful]).sort().values
    return state.x, accepted


def _unfinished(state: _State, of: Tensor, lower: Tensor, upper: Tensor, tolerance: Tensor) -> Tensor:
    moved = torch.maximum(torch.minimum(state.x[of] - state.gradient[of], upper[of]), lower[of]) - state.x[of]
    return of[(moved.abs().amax(-1) > tolerance[of])]


def _take(state: _State, taken: Tensor, x: Tensor, value: Tensor, gradient: Tensor) -> None:
    """Move there, and remember the pair if the function curves upward along the step."""
    step, change = x - state.x[taken], gradient - state.gradient[taken]
    is_curved = (step * change).sum(-1) > LEAST_CURVATURE * step.norm(dim=-1) * change.norm(dim=-1)
    kept = taken[is_curved]
    for memory, newest in ((state.steps, step), (state.changes, change)):
        memory[kept] = torch.cat([memory[kept, 1:], newest[is_curved, None]], dim=1)
    state.x[taken], state.value[taken], state.gradient[taken] = x, value, gradient


def _shrinkage(before: Tensor, after: Tensor, promise: Tensor) -> Tensor:
    """Where the parabola through both values and the first slope is lowest; the least where there is no value."""
    best = -0.5 * promise / (after - before - promise)
    return torch.where(after.isfinite(), best, SHRINK[0]).nan_to_num(SHRINK[0]).clamp(*SHRINK)


def _turn(state: _State, of: Tensor, lower: Tensor, upper: Tensor) -> None:
    """A new direction and a first step length for the functions `of` (b,)."""
    x, gradient = state.x[of], state.gradient[of]
    free = ~(((x <= lower[of]) & (gradient > 0.0)) | ((x >= upper[of]) & (gradient < 0.0)))
    slope = torch.where(free, gradient, 0.0)
    direction = -_two_loops(slope, state.steps[of] * free[:, None], state.changes[of] * free[:, None])
    is_descent = (direction * slope).sum(-1) < -1e-12 * direction.norm(dim=-1) * slope.norm(dim=-1)
    has_memory = state.steps[of, -1].abs().amax(-1) > 0.0
    is_newton = is_descent & has_memory
    state.direction[of] = torch.where(is_newton[:, None], direction, -slope)
    first = 1.0 / slope.norm(dim=-1).clamp(min=1.0)
    state.length[of] = torch.where(is_newton, 1.0, first)


def _two_loops(slope: Tensor, steps: Tensor, changes: Tensor) -> Tensor:
    """The inverse second derivatives' estimate times the slope (b, n); pairs that are zero or do not curve count for nothing."""
    curvature = (steps * changes).sum(-1)  # (b, memory)
    is_kept = curvature > LEAST_CURVATURE * steps.norm(dim=-1) * changes.norm(dim=-1)
    inverse = torch.where(is_kept, 1.0 / torch.where(is_kept, curvature, 1.0), 0.0)
    result, shares = slope, []
    for i in reversed(range(steps.shape[1])):
        share = inverse[:, i] * (steps[:, i] * result).sum(-1)
        result = result - share[:, None] * changes[:, i]
        shares.append(share)
    result = result * _newest_scale(curvature, changes, is_kept)[:, None]
    for i, share in enumerate(reversed(shares)):
        back = inverse[:, i] * (changes[:, i] * result).sum(-1)
        result = result + (share - back)[:, None] * steps[:, i]
    return result


def _newest_scale(curvature: Tensor, changes: Tensor, is_kept: Tensor) -> Tensor:
    """s.y / y.y of the newest pair that is kept (b,); one without any."""
    order = torch.arange(1, is_kept.shape[1] + 1) * is_kept
    newest = order.argmax(-1, keepdim=True)
    size = (changes**2).sum(-1)
    ratio = curvature / torch.where(size > 0.0, size, 1.0)
    return torch.where(is_kept.any(-1), ratio.gather(-1, newest).squeeze(-1), 1.0)
