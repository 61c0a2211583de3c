"""Problems that share one analysis, solved together: the points of a front in one batch."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from lpc_mdo.optimization import OptimizationResult, Options
from lpc_mdo.optimization.batched import minimize_batch
from lpc_mdo.optimization.batched_functions import BatchEvaluate, Observe
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import FAULTS, Land, Lose, Outcome, Task, outcome_of
from lpc_mdo.studies.study import Study


@dataclass(frozen=True)
class Lockstep:
    """All points of a study from the baseline at once, in one batch of this process.

    Points that start elsewhere, or that the batch leaves without a certificate, are run alone.
    """

    is_together: ClassVar[bool] = True
    study: Study
    options: Options

    def run(self, work: Callable[[Task], Outcome], tasks: list[Task], land: Land, lose: Lose) -> float:
        together = [task for task in tasks if task.start is None]
        left = [task for task in tasks if task.start is not None]
        if len(together) < 2:
            return InProcess().run(work, tasks, land, lose)
        try:
            outcomes = self._solved(together)
        except FAULTS:  # one of the points has no problem, or no start: each one tells for itself
            return InProcess().run(work, tasks, land, lose)
        for task, outcome in zip(together, outcomes, strict=True):
            if outcome.entry["status"] == "converged":
                land(outcome)
            else:
                left.append(task)
        return InProcess().run(work, left, land, lose)

    def _solved(self, tasks: list[Task]) -> list[Outcome]:
        """Each point's share of the time is that of all over their number."""
        torch.set_num_threads(1)
        wall, processor = time.monotonic(), time.process_time()
        problems = self.study.problems([self.study.values[task.point] for task in tasks])
        traces = [Trace(problem) for problem in problems]

        def observe(which: Tensor, objective: Tensor, constraints: Tensor) -> None:
            for i, *values in zip(which.tolist(), objective, constraints, strict=True):
                traces[i].add(*values)

        results = solve_together(problems, options=self.options, observe=observe)
        share = 1.0 / len(tasks)
        spent = {"wall": share * (time.monotonic() - wall), "processor": share * (time.process_time() - processor)}
        timing = {"total_s": spent["wall"], "setup_s": 0.0, "optimize_s": spent["wall"], "report_s": 0.0}
        outcomes = []
        for task, problem, result, trace in zip(tasks, problems, results, traces, strict=True):
            whole = problem.analyze_design
            content = result_file.build(problem, result, whole.vehicle, whole.mission, self.options, timing)
            outcomes.append(outcome_of(self.study, task, problem, result, content, trace, spent))
        return outcomes


def solve_together(
    problems: Sequence[Problem],
    options: Options | None = None,
    observe: Observe = lambda which, objective, constraints: None,
) -> list[OptimizationResult]:
    """Optima of problems that differ in their objectives and limits only, each from its own start.

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
        stacked("x0"),
        stacked("lower"),
        stacked("upper"),
        stacked("constraint_lower"),
        stacked("constraint_upper"),
        options,
        observe,
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
