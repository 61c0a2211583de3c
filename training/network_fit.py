"""Levenberg-Marquardt fit of a network with two hidden layers and two outputs, robust and reproducible.

A few hundred variables and some ten thousand residuals: the normal equations fit in the cache, and their steps reach in
a hundred iterations what first-order methods do not reach in ten thousand.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

RIDGE = 1e-7  # of the sum of squares of the weights: holds directions that the data do not determine
BLOCK = 256  # points whose derivatives are held at a time
INPUT_SCALE = (
    1.0,
    1.0,
    0.3,
)  # of the first weights: few Mach numbers are sampled and the flow changes gently with them
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-12, 1e12  # of the mean diagonal of the normal matrix


@dataclass(frozen=True)
class Samples:
    """inputs (point, 3), targets (point, 2) in units of errors that weigh the same, weight (point,)."""

    inputs: Tensor
    targets: Tensor
    weight: Tensor


@dataclass(frozen=True)
class State:
    """Where a fit stands: parameters (parameter,), damping, iterations done; `has_ended` where no step helps."""

    parameters: Tensor
    damping: float
    iteration: int
    has_ended: bool = False


def parameter_count(hidden: int) -> int:
    return 3 * hidden + hidden + hidden * hidden + hidden + 2 * hidden + 2


def start(hidden: int, seed: int) -> State:
    """Random parameters; hidden units spread over the inputs, which lie in [-1, 1]."""
    generator = torch.Generator().manual_seed(seed)
    parts, width = [], 3
    for out in (hidden, hidden, 2):
        scale = (2.0 if width == 3 else 1.0) / width**0.5
        matrix = scale * torch.randn(out, width, generator=generator, dtype=torch.float64)
        if width == 3:
            matrix = matrix * torch.tensor(INPUT_SCALE, dtype=torch.float64)
        parts.append(matrix.flatten())
        parts.append(0.5 * torch.randn(out, generator=generator, dtype=torch.float64))
        width = out
    return State(torch.cat(parts), damping=1.0, iteration=0)


def layers(parameters: Tensor, hidden: int) -> list[tuple[Tensor, Tensor]]:
    """Pairs (matrix (out, in), bias (out,)) with hyperbolic tangents between."""
    pairs, first, width = [], 0, 3
    for out in (hidden, hidden, 2):
        matrix = parameters[first : first + out * width].reshape(out, width)
        pairs.append((matrix, parameters[first + out * width : first + out * width + out]))
        first, width = first + out * width + out, out
    return pairs


def logistic_layers(parameters: Tensor, hidden: int) -> list[tuple[Tensor, Tensor]]:
    """The same network with logistic functions between: tanh(z) = 2 logistic(2 z) - 1."""
    (m1, b1), (m2, b2), (m3, b3) = layers(parameters, hidden)
    return [(2.0 * m1, 2.0 * b1), (4.0 * m2, 2.0 * (b2 - m2.sum(-1))), (2.0 * m3, b3 - m3.sum(-1))]


def outputs(parameters: Tensor, inputs: Tensor, hidden: int) -> Tensor:
    """(point, 2)."""
    (m1, b1), (m2, b2), (m3, b3) = layers(parameters, hidden)
    first = torch.tanh(inputs @ m1.T + b1)
    return torch.tanh(first @ m2.T + b2) @ m3.T + b3


def outputs_and_jacobian(parameters: Tensor, inputs: Tensor, hidden: int) -> tuple[Tensor, Tensor]:
    """Outputs (point, 2) and their derivatives (point, 2, parameter) by back-propagation of both at once."""
    (m1, b1), (m2, b2), (m3, b3) = layers(parameters, hidden)
    first = torch.tanh(inputs @ m1.T + b1)
    second = torch.tanh(first @ m2.T + b2)
    at_second = (1.0 - second**2)[:, None, :] * m3  # (point, 2, hidden)
    at_first = (at_second @ m2) * (1.0 - first**2)[:, None, :]
    count = len(inputs)
    last = torch.eye(2, dtype=inputs.dtype)
    blocks = [
        (at_first[..., None] * inputs[:, None, None, :]).reshape(count, 2, -1),
        at_first,
        (at_second[..., None] * first[:, None, None, :]).reshape(count, 2, -1),
        at_second,
        (last[:, :, None] * second[:, None, None, :]).reshape(count, 2, -1),
        last.expand(count, 2, 2),
    ]
    return second @ m3.T + b3, torch.cat(blocks, dim=-1)


def objective(parameters: Tensor, samples: Samples, hidden: int) -> float:
    """Mean pseudo-Huber loss: scatter of the data enters with its size, not with its square."""
    errors = outputs(parameters, samples.inputs, hidden) - samples.targets
    loss = (samples.weight[:, None] * (torch.sqrt(1.0 + errors**2) - 1.0)).mean()
    return float(loss + RIDGE * parameters @ parameters)


def fit(samples: Samples, state: State, hidden: int, iterations: int, on_iteration: Callable[[State], None]) -> State:
    """The state after `iterations` in all, or where no step lowers the objective any more.

    A pure function of its arguments: a fit that stops on the way and goes on from its state ends in the same bits.
    `on_iteration` sees every state.
    """
    while state.iteration < iterations and not state.has_ended:
        state = _step(samples, state, hidden)
        on_iteration(state)
    return state


def _step(samples: Samples, state: State, hidden: int) -> State:
    """One Gauss-Newton step on the reweighted squares, damped until the objective falls."""
    parameters = state.parameters
    before = objective(parameters, samples, hidden)
    normal, gradient = _normal_equations(parameters, samples, hidden)
    size = float(normal.diagonal().mean())
    damping = state.damping
    while damping < LARGEST_DAMPING:
        shift = torch.full_like(parameters, damping * size + 2.0 * RIDGE)
        factor, fault = torch.linalg.cholesky_ex(normal + torch.diag(shift))
        trial = parameters - torch.cholesky_solve(gradient[:, None], factor)[:, 0]
        if not bool(fault) and objective(trial, samples, hidden) < before:
            return State(trial, max(damping / 3.0, SMALLEST_DAMPING), state.iteration + 1)
        damping *= 3.0
    return replace(state, iteration=state.iteration + 1, has_ended=True)


def _normal_equations(parameters: Tensor, samples: Samples, hidden: int) -> tuple[Tensor, Tensor]:
    """Normal matrix (parameter, parameter) of the reweighted squares and gradient (parameter,) of the objective."""
    count = samples.targets.numel()
    normal = torch.zeros(len(parameters), len(parameters), dtype=parameters.dtype)
    gradient = 2.0 * RIDGE * parameters
    parts = zip(*(column.split(BLOCK) for column in (samples.inputs, samples.targets, samples.weight)), strict=True)
    for inputs, targets, weight in parts:
        values, jacobian = outputs_and_jacobian(parameters, inputs, hidden)
        errors = values - targets
        scale = torch.sqrt(weight[:, None] / torch.sqrt(1.0 + errors**2) / count)
        rows = (jacobian * scale[..., None]).flatten(0, 1)
        normal.addmm_(rows.T, rows)
        gradient.addmv_(rows.T, (scale * errors).flatten())
    return normal, gradient
