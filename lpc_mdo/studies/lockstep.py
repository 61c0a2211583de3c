"""Problems that share one analysis, solved together: the points of a front in one batch."""

from collections.abc import Sequence

import torch
from torch import Tensor

from lpc_mdo.optimization import OptimizationResult, Options
from lpc_mdo.optimization.batched import minimize_batch
from lpc_mdo.optimization.batched_functions import BatchEvaluate
from lpc_mdo.problems.problem import Problem


def solve_together(
    problems: Sequence[Problem], x0: Tensor | None = None, options: Options | None = None
) -> list[OptimizationResult]:
    """Optima of problems that differ in their objectives and limits only; x0 (k, n), each problem's own start if left out.

    Raises ValueError if their analyses, variables or rows are not the same.
    """
    first = problems[0]
    for problem in problems:
        is_alike = problem.analyze_design is first.analyze_design and problem.variables == first.variables
        if not is_alike or [row.name for row in problem.constraints] != [row.name for row in first.constraints]:
            raise ValueError("problems with different analyses, variables or rows are not allowed in one batch")

    def stacked(name: str) -> Tensor:
        return torch.stack([getattr(problem, name) for problem in problems])

    return minimize_batch(
        shared_evaluate(problems),
        stacked("x0") if x0 is None else x0,
        stacked("lower"),
        stacked("upper"),
        stacked("constraint_lower"),
        stacked("constraint_upper"),
        options,
    )


def shared_evaluate(problems: Sequence[Problem]) -> BatchEvaluate:
    """One analysis for points (b, n) of all problems; each point's objective is that of its own problem."""
    first = problems[0]

    def evaluate(x: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        analysis = first.analyze(x)
        objectives = torch.stack([p.objective.of(analysis) / p.objective.scale for p in problems])
        rows = zip(first.rows(analysis), first.constraints, strict=True)
        scaled = torch.cat([row / constraint.scale for row, constraint in rows], dim=-1)
        return objectives[which, torch.arange(len(which))], scaled

    return evaluate
