"""One interface to all solvers: scale, solve, certify."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.optimization.certificate import Certificate, certify
from lpc_mdo.optimization.evaluator import Evaluate, Evaluator, scales
from lpc_mdo.optimization.optimizer import Task
from lpc_mdo.optimization.presolve import Presolve, presolve
from lpc_mdo.optimization.registry import DEFAULT, OPTIMIZERS
from lpc_mdo.optimization.result import Hooks, OptimizationResult, Options, Progress, Status


def minimize(
    objective: Callable[[Tensor], Tensor],
    x0: Tensor,
    lower: Tensor | None = None,
    upper: Tensor | None = None,
    constraints: Callable[[Tensor], Tensor] | None = None,
    constraint_lower: Tensor | None = None,
    constraint_upper: Tensor | None = None,
    **options: Any,
) -> OptimizationResult:
    """Minimize objective(x) over lower <= x <= upper with constraint_lower <= constraints(x) <= constraint_upper.

    x (n,) float64; objective returns a scalar, constraints (m,); None stands for no bound. Further options as in
    `minimize_problem` (solver, options, hooks, state, is_batched, multipliers).
    """

    def evaluate(x: Tensor) -> tuple[Tensor, Tensor]:
        return objective(x), x.new_zeros(0) if constraints is None else constraints(x)

    count = 0 if constraints is None else len(constraints(x0.detach()))
    return minimize_problem(
        evaluate,
        x0,
        _bound(lower, len(x0), -np.inf),
        _bound(upper, len(x0), np.inf),
        _bound(constraint_lower, count, -np.inf),
        _bound(constraint_upper, count, np.inf),
        **options,
    )


def _bound(values: Tensor | None, count: int, default: float) -> Tensor:
    return torch.full((count,), default, dtype=torch.float64) if values is None else values


def minimize_problem(
    evaluate: Evaluate,
    x0: Tensor,
    lower: Tensor,
    upper: Tensor,
    constraint_lower: Tensor,
    constraint_upper: Tensor,
    solver: str = DEFAULT,
    options: Options | None = None,
    hooks: Hooks | None = None,
    state: dict[str, Any] | None = None,
    is_batched: bool = False,
    multipliers: Tensor | None = None,
) -> OptimizationResult:
    """Minimize f subject to c, both from one graph: evaluate(x) -> (f, c).

    Affine equations of two variables are solved beforehand. `is_batched`: evaluate also takes (k, n) and treats every point
    alone, which makes second derivatives cheap. `multipliers` (m,): those of a neighbouring optimum x0, as results carry
    them; the augmented Lagrangian then tries Newton's method first.
    `state`: a checkpoint of an earlier run of the augmented Lagrangian on the same problem, to go on from.
    Raises ValueError for an unknown solver, crossed bounds, a start or checkpoint of the wrong length, or a start at
    which the model fails.
    """
    if solver not in OPTIMIZERS:
        raise ValueError(f"solver = {solver!r} is not allowed; it must be one of {', '.join(OPTIMIZERS)}")
    options, hooks = options or Options(), hooks or Hooks()
    numpy = [t.detach().numpy().astype(float) for t in (lower, upper, constraint_lower, constraint_upper)]
    if (numpy[0] > numpy[1]).any() or (numpy[2] > numpy[3]).any():
        raise ValueError("bounds are not allowed: a lower one lies above its upper one")
    evaluator = Evaluator(_watched(evaluate, hooks), *numpy, is_batched=is_batched)
    start = np.clip(x0.detach().numpy().astype(float), numpy[0], numpy[1])
    if state is not None and len(state["x"]) != len(start):
        raise ValueError(f"checkpoint of {len(state['x'])} variables is not allowed; the problem has {len(start)}")
    if not evaluator.is_finite(start):
        raise ValueError("the start is not allowed: objective or constraints are not finite there")
    evaluator.objective_scale, evaluator.constraint_scale = scales(evaluator, start)
    if state is not None:
        evaluator.objective_scale = state["objective_scale"]
        evaluator.constraint_scale = np.array(state["constraint_scale"])
    solved = presolve(evaluator, start)
    reduced = Evaluator(
        solved.compose(evaluator.evaluate),
        solved.lower,
        solved.upper,
        evaluator.constraint_lower[solved.rows],
        evaluator.constraint_upper[solved.rows],
        evaluator.objective_scale,
        evaluator.constraint_scale[solved.rows],
        is_batched,
        evaluator.counts,
    )
    if len(solved.rows):
        reduced.inherit_affine(evaluator, solved.rows, solved.matrix, solved.offset)
    hooks = _of_the_whole(hooks, solved, evaluator, reduced)
    optimizer = OPTIMIZERS[solver]
    task = Task(
        reduced,
        solved.restrict(start),
        options,
        hooks,
        None if multipliers is None else _scaled(multipliers.numpy(), evaluator)[solved.rows],
        None if state is None else _presolved(state, solved),
    )
    outcome = optimizer.run(task)
    z, found, status, message = outcome.x, outcome.multipliers, outcome.status, outcome.message
    evaluator.objective_scale = reduced.objective_scale
    evaluator.constraint_scale = solved.spread(reduced.constraint_scale, evaluator.constraint_scale)
    x = np.clip(solved.expand(z), evaluator.lower, evaluator.upper)
    found = solved.expand_multipliers(evaluator, x, found)
    certificate = certify(evaluator, x, found)
    if status == "converged" and not certificate.holds(options.stationarity_tolerance, options.feasibility_tolerance):
        status, message = "iteration_limit", "the certificate holds for the presolved problem, not for the whole one"
    history = [_with_whole_row(record, solved) for record in outcome.history]
    return _result(evaluator, x, found, certificate, status, message, history)


def _presolved(state: dict[str, Any], solved: Presolve) -> dict[str, Any]:
    """The checkpoint of the whole problem as one of the presolved problem."""
    x, multipliers = np.array(state["x"]), np.array(state["multipliers"])
    return state | {"x": solved.restrict(x), "multipliers": multipliers[solved.rows]}


def _scaled(multipliers: np.ndarray, evaluator: Evaluator) -> np.ndarray:
    """Multipliers of the scaled problem from those of the problem as it was given."""
    return multipliers * evaluator.objective_scale / evaluator.constraint_scale


def _with_whole_row(record: Progress, solved: Presolve) -> Progress:
    """The record with the worst constraint's index among all rows."""
    worst = record.worst_constraint
    return replace(record, worst_constraint=int(solved.rows[worst]) if worst >= 0 else worst)


def _of_the_whole(hooks: Hooks, solved: Presolve, evaluator: Evaluator, reduced: Evaluator) -> Hooks:
    """Hooks that tell the caller of the whole problem, given to a solver of the presolved one."""

    def checkpoint(state: dict[str, Any]) -> None:
        whole = {
            "x": solved.expand(np.array(state["x"])).tolist(),
            "multipliers": solved.spread(np.array(state["multipliers"])).tolist(),
            "objective_scale": reduced.objective_scale,
            "constraint_scale": solved.spread(reduced.constraint_scale, evaluator.constraint_scale).tolist(),
        }
        hooks.checkpoint(state | whole)

    return Hooks(progress=lambda record: hooks.progress(_with_whole_row(record, solved)), checkpoint=checkpoint)


def _watched(evaluate: Evaluate, hooks: Hooks) -> Evaluate:
    def watched(x: Tensor) -> tuple[Tensor, Tensor]:
        objective, constraints = evaluate(x)
        if objective.dim() == 0:  # batches serve derivatives
            hooks.evaluation(objective.detach(), constraints.detach())
        return objective, constraints

    return watched


def _result(
    evaluator: Evaluator,
    x: np.ndarray,
    multipliers: np.ndarray,
    certificate: Certificate,
    status: Status,
    message: str,
    history: list[Progress],
) -> OptimizationResult:
    objective, values = evaluator.values(x)
    return OptimizationResult(
        x=torch.from_numpy(x.copy()),
        objective=objective / evaluator.objective_scale,
        constraints=torch.from_numpy(values / evaluator.constraint_scale),
        multipliers=torch.from_numpy(multipliers * evaluator.constraint_scale / evaluator.objective_scale),
        certificate=certificate,
        status=status,
        message=message,
        counts=evaluator.counts,
        objective_scale=evaluator.objective_scale,
        constraint_scale=evaluator.constraint_scale,
        history=history,
    )
