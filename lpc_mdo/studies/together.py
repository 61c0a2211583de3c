"""Problems that share one analysis, solved in one batch: points of a front, or one problem from many starts."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import OptimizationResult, Options
from lpc_mdo.optimization.batched import minimize_batch
from lpc_mdo.optimization.batched_functions import BatchEvaluate, Observe
from lpc_mdo.optimization.certificate import certify
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.presolve import Presolve, presolve
from lpc_mdo.problems.problem import Problem


@one_thread()
def solve_together(
    problems: Sequence[Problem],
    options: Options | None = None,
    observe: Observe = lambda which, objective, constraints: None,
) -> list[OptimizationResult]:
    """Optima of problems that differ in objectives, limits of inequalities and starts only, each from its own start.

    Equations of two variables are solved beforehand, as for one problem; `observe` is not told of their rows, and sees zero.
    Raises ValueError if analyses, variables, rows or equations are not the same.
    """
    first, options = problems[0], options or Options()
    _require_alike(problems)
    limits = [_stacked(problems, name) for name in ("lower", "upper", "constraint_lower", "constraint_upper")]
    evaluator = Evaluator(first.evaluate, *(limit[0].numpy() for limit in limits), is_batched=True)
    solved = presolve(evaluator, first.x0.numpy())
    rows = torch.from_numpy(solved.rows)
    starts = np.stack([solved.restrict(problem.x0.numpy()) for problem in problems])
    count = len(problems)

    def observe_whole(which: Tensor, objective: Tensor, constraints: Tensor) -> None:
        whole = constraints.new_zeros(len(which), limits[2].shape[1])
        whole[:, rows] = constraints
        observe(which, objective, whole)

    results = minimize_batch(
        _reduced(shared_evaluate(problems), solved),
        torch.from_numpy(starts),
        torch.from_numpy(solved.lower).expand(count, -1),
        torch.from_numpy(solved.upper).expand(count, -1),
        limits[2][:, rows],
        limits[3][:, rows],
        options,
        observe_whole,
    )
    if not solved.substitutions:
        return results
    return [
        _of_the_whole(replace(evaluator, evaluate=problem.evaluate, _point=None), solved, result, options)
        for problem, result in zip(problems, results, strict=True)
    ]


def _stacked(problems: Sequence[Problem], name: str) -> Tensor:
    return torch.stack([getattr(problem, name) for problem in problems])


def _require_alike(problems: Sequence[Problem]) -> None:
    first = problems[0]

    def shape(problem: Problem) -> list[object]:
        variables = [
            (v.name, list(map(float, v.lower_tensor.flatten())), list(map(float, v.upper_tensor.flatten())), v.size)
            for v in problem.variables
        ]
        rows = [(r.name, r.scale, r.kind, r.lower if r.kind == "equality" else None) for r in problem.constraints]
        return [variables, rows]

    for problem in problems[1:]:
        if problem.analyze_design is not first.analyze_design or shape(problem) != shape(first):
            raise ValueError("problems with different analyses, variables or equations are not allowed in one batch")


def shared_evaluate(problems: Sequence[Problem]) -> BatchEvaluate:
    """One analysis for points (b, n) of all problems; each point's objective is that of its own problem."""
    first = problems[0]
    objectives = list({id(problem.objective): problem.objective for problem in problems}.values())
    place = {id(objective): i for i, objective in enumerate(objectives)}
    own = torch.tensor([place[id(problem.objective)] for problem in problems])

    def evaluate(x: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        analysis = first.analyze(x)
        values = torch.stack([objective.of(analysis) / objective.scale for objective in objectives])
        rows = zip(first.rows(analysis), first.constraints, strict=True)
        scaled = torch.cat([row / constraint.scale for row, constraint in rows], dim=-1)
        return values[own[which], torch.arange(len(which))], scaled

    return evaluate


def _reduced(evaluate: BatchEvaluate, solved: Presolve) -> BatchEvaluate:
    """The same functions of the variables that the presolve leaves, with the rows that it leaves."""
    rows = torch.from_numpy(solved.rows)

    def reduced(z: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        objective, constraints = evaluate(solved.expanded(z), which)
        return objective, constraints[:, rows]

    return reduced


def _of_the_whole(
    evaluator: Evaluator, solved: Presolve, result: OptimizationResult, options: Options
) -> OptimizationResult:
    """The result with all variables and rows, certified as such."""
    x = np.clip(solved.expand(result.x.numpy()), evaluator.lower, evaluator.upper)
    evaluator.objective_scale = result.objective_scale
    evaluator.constraint_scale = solved.spread(result.constraint_scale, 1.0)
    kept = result.multipliers.numpy() * result.objective_scale / result.constraint_scale
    multipliers = solved.expand_multipliers(evaluator, x, kept)
    certificate = certify(evaluator, x, multipliers)
    objective, values = evaluator.values(x)
    is_lost = result.status == "converged" and not certificate.holds(
        options.stationarity_tolerance, options.feasibility_tolerance
    )
    return replace(
        result,
        x=torch.from_numpy(x.copy()),
        objective=objective / evaluator.objective_scale,
        constraints=torch.from_numpy(values / evaluator.constraint_scale),
        multipliers=torch.from_numpy(multipliers * evaluator.constraint_scale / evaluator.objective_scale),
        certificate=certificate,
        status="iteration_limit" if is_lost else result.status,
        message="the certificate holds for the presolved problem, not for the whole one" if is_lost else result.message,
        constraint_scale=evaluator.constraint_scale,
        history=[
            replace(record, worst_constraint=_whole_row(record.worst_constraint, solved)) for record in result.history
        ],
    )


def _whole_row(row: int, solved: Presolve) -> int:
    return int(solved.rows[row]) if row >= 0 else row
