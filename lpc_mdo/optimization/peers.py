"""Other codes on the same scaled problem, judged by the same certificate as ours: what they have in common."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from lpc_mdo.optimization.certificate import least_squares_multipliers, violation
from lpc_mdo.optimization.judge import fault_at
from lpc_mdo.optimization.model import TimeLimit
from lpc_mdo.optimization.optimizer import Outcome, Task
from lpc_mdo.optimization.result import Progress, Status

SETTLED = 1e-5  # scaled distance from a limit up to which a row may press


@dataclass
class Watch:
    """Tells the caller of every iteration and keeps the newest point; the evaluator holds the time limit."""

    solver: str
    task: Task
    history: list[Progress] = field(default_factory=list)
    started: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        self.latest = self.task.x.copy()

    def add(self, x: np.ndarray) -> None:
        evaluator = self.task.evaluator
        self.latest = x.copy()
        objective, values = evaluator.values(x)
        beyond = np.abs(violation(values, *evaluator.limits))
        evaluator.counts.outer += 1
        self.history.append(
            Progress(
                phase=self.solver,
                iteration=evaluator.counts.outer,
                objective=objective / evaluator.objective_scale,
                violation=float(beyond.max(initial=0.0)),
                worst_constraint=int(beyond.argmax()) if len(beyond) else -1,
                stationarity=float("nan"),
                penalty=float("nan"),
                evaluations=evaluator.counts.evaluations,
                elapsed=time.monotonic() - self.started,
            )
        )
        self.task.hooks.progress(self.history[-1])


Solve = Callable[[Watch], tuple[np.ndarray, Status, str]]
"""From a watched task to x (n,), status and the code's own message."""


def run_peer(name: str, solve: Solve, task: Task) -> Outcome:
    """The code's end with least-squares multipliers; its own "converged" is left to the certificate to confirm."""
    watch = Watch(name, task)
    evaluator = task.evaluator
    try:
        x, status, message = solve(watch)
    except KeyboardInterrupt:
        x, status, message = watch.latest, "interrupted", "stopped by the user"
    except TimeLimit:
        x, status, message = watch.latest, "time_limit", f"the time limit of {task.options.time_limit:g} s was reached"
    evaluator.model.deadline = float("inf")
    x = np.clip(x, evaluator.lower, evaluator.upper)
    multipliers = least_squares_multipliers(evaluator, x, active_tolerance=SETTLED)
    tolerances = task.options.stationarity_tolerance, task.options.feasibility_tolerance
    found = fault_at(evaluator, x, multipliers, tolerances)
    if found is None:
        status = "converged"
    elif status == "converged":
        status, message = "failed", f"{message}, by its own rules; but {found.words}"
    return Outcome(x, multipliers, status, message, watch.history)
