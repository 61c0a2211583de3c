"""Problems that share one analysis, solved side by side: points of a front, or one problem from many starts."""

from collections.abc import Sequence

import torch
from torch import Tensor

from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import Hooks, OptimizationResult, Options
from lpc_mdo.optimization.hub import Ending, Hub, SharedEvaluate
from lpc_mdo.optimization.model import Evaluate
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.single import minimum


@one_thread()
def solve_together(
    problems: Sequence[Problem],
    solver: str = "sqp",
    options: Options | None = None,
    hooks: Sequence[Hooks] | None = None,
) -> list[Ending[OptimizationResult]]:
    """How the search for each problem's optimum ended, each from its own start and with hooks of its own.

    A problem whose start is refused ends with that ValueError and harms no other. Raises ValueError if analyses, variables
    or rows are not the same.
    """

    def work(i: int, evaluate: Evaluate) -> OptimizationResult:
        own = Hooks() if hooks is None else hooks[i]
        return minimum(problems[i], problems[i].x0, solver=solver, options=options, hooks=own, evaluate=evaluate)

    return Hub(shared_evaluate(problems), work, len(problems)).run()


def are_alike(one: Problem, other: Problem) -> bool:
    """Whether both have one analysis, and variables and rows that differ in limits and starts at most: x is scaled by the bounds."""

    def shape(problem: Problem) -> list[object]:
        variables = [(v.name, v.size, v.lower_tensor.tolist(), v.upper_tensor.tolist()) for v in problem.variables]
        return [variables, [(r.name, r.scale) for r in problem.constraints]]

    return one.analyze_design is other.analyze_design and shape(one) == shape(other)


def shared_evaluate(problems: Sequence[Problem]) -> SharedEvaluate:
    """One analysis for points (b, n) of all problems; each point's objective is that of its own problem.

    Raises ValueError if analyses, variables or rows are not the same.
    """
    first = problems[0]
    if not all(are_alike(problem, first) for problem in problems):
        raise ValueError("problems with different analyses, variables or rows are not allowed in one batch")
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
