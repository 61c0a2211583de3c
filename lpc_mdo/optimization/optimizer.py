"""What an optimizer is to the rest: a name, whether it keeps checkpoints, and a function from a task to an outcome."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.result import Hooks, Options, Progress, Status


@dataclass(frozen=True)
class Task:
    """A scaled problem from x (n,), within its bounds. multipliers (m,): scaled ones of a neighbouring optimum; state: a checkpoint."""

    evaluator: Evaluator
    x: np.ndarray
    options: Options
    hooks: Hooks
    multipliers: np.ndarray | None = None
    state: dict[str, Any] | None = None


@dataclass(frozen=True)
class Outcome:
    """Where an optimizer ended: x (n,) with scaled multipliers (m,), and why there."""

    x: np.ndarray
    multipliers: np.ndarray
    status: Status
    message: str
    history: list[Progress] = field(default_factory=list)


@dataclass(frozen=True)
class Optimizer:
    """One way to solve a task; `keeps_checkpoints`: a run that was killed goes on from its newest checkpoint."""

    name: str
    run: Callable[[Task], Outcome]
    keeps_checkpoints: bool = False
