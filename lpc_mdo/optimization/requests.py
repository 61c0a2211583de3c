"""What a solver asks of the model, and how torch asks it: values at points, and gradients of weighted sums of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable


@dataclass(eq=False)
class Batch:
    """One evaluation with its graph, kept as long as anybody holds points of it."""

    points: Tensor  # (b, n)
    objective: Tensor  # (b,)
    constraints: Tensor  # (b, m)


@dataclass(frozen=True)
class Answer:
    """Objectives (p,) and constraints (p, m): those of the batch's points from `first` on."""

    objective: Tensor
    constraints: Tensor
    batch: Batch
    first: int

    @property
    def place(self) -> slice:
        return slice(self.first, self.first + len(self.objective))


@dataclass(frozen=True)
class Begin:
    """Asks to begin."""


@dataclass(frozen=True)
class Values:
    """Asks for values at points (p, n); `has_graph`: gradients may be asked for later."""

    points: Tensor
    has_graph: bool
    turn: int  # of the hub, in which it was asked


@dataclass(frozen=True)
class Slopes:
    """Asks for gradients (p, n) of sums of an answer's values, weighted by (p,) and (p, m); None: by zero."""

    answer: Answer
    objective: Tensor | None
    constraints: Tensor | None


Request = Begin | Values | Slopes


@dataclass(frozen=True)
class Reply:
    """To a request: an Answer, gradients (p, n), or an exception to raise where it was asked."""

    content: Any


def count_points(request: Values | Slopes) -> int:
    """Points that a request is about."""
    return len(request.points) if isinstance(request, Values) else len(request.answer.objective)


class Remote(torch.autograd.Function):
    """The model as torch sees it in a solver's thread: values, and gradients backward, come from the hub."""

    @staticmethod
    def forward(ctx: Any, points: Tensor, ask: Callable[[Request], Any], turn: int) -> tuple[Tensor, Tensor]:
        ctx.set_materialize_grads(False)
        ctx.ask, ctx.answer = ask, ask(Values(points.detach(), True, turn))
        # Copies: a result that its own node keeps would never be freed, and the batch's graph with it.
        return ctx.answer.objective.clone(), ctx.answer.constraints.clone()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, objective: Tensor | None, constraints: Tensor | None) -> tuple[Tensor, None, None]:
        return ctx.ask(Slopes(ctx.answer, objective, constraints)), None, None
