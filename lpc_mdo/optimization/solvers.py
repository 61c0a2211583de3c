"""One interface to all solvers: scale, solve, certify."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.optimization.certificate import Certificate, certify
from lpc_mdo.optimization.evaluator import Evaluate, Evaluator
from lpc_mdo.optimization.optimizer import Outcome, Task
from lpc_mdo.optimization.presolve import Presolve, presolve
from lpc_mdo.optimization.registry import DEFAULT, OPTIMIZERS
from lpc_mdo.optimization.result import Hooks, OptimizationResult, Options, Progress, Status
from lpc_mdo.optimization.scaling import scales

Vector = Tensor | Sequence[float] | np.ndarray


def minimize(
    objective: Callable[[Tensor], Tensor],
    x0: Vector,
    lower: Vector | None = None,
    upper: Vector | None = None,
    constraints: Callable[[Tensor], Tensor] | None = None,
    constraint_lower: Vector | None = None,
    constraint_upper: Vector | None = None,
    **options: Any,
) -> OptimizationResult:
    """Minimize objective(x) over lower <= x <= upper with constraint_lower <= constraints(x) <= constraint_upper.

    x (n,) float64; objective returns a scalar, constraints (m,) or a scalar; None stands for no bound. Further options as in
    `minimize_problem` (solver, options, hooks, state, is_batched, multipliers). Raises ValueError as that does.
    """
    start = _vector("x0", x0)

    def evaluate(x: Tensor) -> tuple[Tensor, Tensor]:
        value = torch.as_tensor(objective(x), dtype=torch.float64)
        if constraints is None:
            return value.reshape(value.shape if x.dim() > 1 else ()), x.new_zeros((*x.shape[:-1], 0))
        rows = torch.as_tensor(constraints(x), dtype=torch.float64)
        return value.reshape(value.shape if x.dim() > 1 else ()), rows.reshape(-1) if x.dim() == 1 else rows

    count = 0 if constraints is None else evaluate(start.detach())[1].numel()
    return minimize_problem(
        evaluate,
        start,
        _bound("lower", lower, len(start), -np.inf),
        _bound("upper", upper, len(start), np.inf),
        _bound("constraint_lower", constraint_lower, count, -np.inf),
        _bound("constraint_upper", constraint_upper, count, np.inf),
        **options,
    )


def _vector(name: str, values: Vector) -> Tensor:
    try:
        vector = torch.as_tensor(values, dtype=torch.float64).detach()
    except (TypeError, ValueError, RuntimeError):
        raise ValueError(f"{name} = {values!r} is invalid: it must be a vector of numbers") from None
    if vector.dim() != 1 or len(vector) == 0:
        raise ValueError(
            f"{name} of shape {tuple(vector.shape)} is invalid: it must be a vector of at least one number"
        )
    return vector


def _bound(name: str, values: Vector | float | None, count: int, default: float) -> Tensor:
    """One number serves all entries."""
    if values is None:
        return torch.full((count,), default, dtype=torch.float64)
    vector = torch.as_tensor(values, dtype=torch.float64).detach()
    return vector.expand(count) if vector.dim() == 0 else vector


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
    limits = _limits(x0, lower, upper, constraint_lower, constraint_upper)
    evaluator = Evaluator(_watched(evaluate, hooks), *limits, is_batched=is_batched)
    start = np.clip(x0.detach().numpy().astype(float), *limits[:2])
    if state is not None and len(state["x"]) != len(start):
        raise ValueError(f"checkpoint of {len(state['x'])} variables is not allowed; the problem has {len(start)}")
    _require_derivatives(evaluator, start)
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
        reduced.inherit_affine(evaluator, solved.rows, solved.columns, solved.offset)
    hooks = _of_the_whole(hooks, solved, evaluator, reduced)
    task = Task(
        reduced,
        solved.restrict(start),
        options,
        hooks,
        None if multipliers is None else _scaled(multipliers.numpy(), evaluator)[solved.rows],
        None if state is None else _presolved(state, solved),
    )
    outcome = OPTIMIZERS[solver].run(task) if len(solved.variables) else _nothing_to_choose(task)
    z, found, status, message = outcome.x, outcome.multipliers, outcome.status, outcome.message
    evaluator.objective_scale = reduced.objective_scale
    evaluator.constraint_scale = solved.spread(reduced.constraint_scale, evaluator.constraint_scale)
    x = np.clip(solved.expand(z), evaluator.lower, evaluator.upper)
    found = solved.expand_multipliers(evaluator, x, found)
    certificate = certify(evaluator, x, found)
    if status == "converged" and not certificate.holds(options.stationarity_tolerance, options.feasibility_tolerance):
        status, message = "failed", "the certificate holds for the presolved problem, not for the whole one"
    history = [_with_whole_row(record, solved) for record in outcome.history]
    return _result(evaluator, x, found, certificate, status, message, history)


def _nothing_to_choose(task: Task) -> Outcome:
    """The only design there is, where bounds or equations fix all variables."""
    evaluator, multipliers = task.evaluator, np.zeros(len(task.evaluator.constraint_lower))
    missed = certify(evaluator, task.x, multipliers).feasibility
    if missed <= task.options.feasibility_tolerance:
        return Outcome(task.x, multipliers, "converged", "bounds and equations leave one design")
    message = f"bounds and equations leave one design, which violates a constraint by {missed:.3g} (scaled)"
    return Outcome(task.x, multipliers, "infeasible", message)


def _limits(x0: Tensor, *limits: Tensor) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The four limits as arrays. Raises ValueError for wrong lengths, NaN, or a lower limit above its upper one."""
    lower, upper, least, greatest = (limit.detach().numpy().astype(float) for limit in limits)
    if not bool(x0.isfinite().all()):
        raise ValueError("x0 is invalid: it must hold finite numbers")
    for name, limit, count in (
        ("lower", lower, len(x0)),
        ("upper", upper, len(x0)),
        ("constraint_lower", least, len(least)),
        ("constraint_upper", greatest, len(least)),
    ):
        if limit.shape != (count,):
            raise ValueError(f"{name} of shape {limit.shape} is invalid: it must have {count} entries")
        if np.isnan(limit).any():
            raise ValueError(f"{name} is invalid: entry {int(np.isnan(limit).argmax())} is NaN")
    for names, low, high in (("lower, upper", lower, upper), ("constraint_lower, constraint_upper", least, greatest)):
        if (low > high).any():
            i = int((low > high).argmax())
            raise ValueError(f"bounds are not allowed: {names} have {low[i]:g} above {high[i]:g} in entry {i}")
    return lower, upper, least, greatest


def _require_derivatives(evaluator: Evaluator, start: np.ndarray) -> None:
    """Raises ValueError where objective, constraints or their gradients are not finite at the start."""
    if not evaluator.is_finite(start):
        raise ValueError("the start is not allowed: objective or constraints are not finite there")
    rows = evaluator.values(start)[1]
    if rows.shape != evaluator.constraint_lower.shape:
        raise ValueError(
            f"constraint limits are invalid: there are {len(evaluator.constraint_lower)}, and {len(rows)} constraints"
        )
    if not np.isfinite(evaluator.gradient(start, np.zeros(len(rows)))).all():
        raise ValueError("the start is not allowed: the objective's gradient is not finite there")
    if not np.isfinite(evaluator.jacobian(start)).all():
        raise ValueError("the start is not allowed: a constraint's gradient is not finite there")


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
