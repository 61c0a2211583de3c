"""One point of a study: its task, the search for its optimum, and what of it goes to its folder."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import Hooks, OptimizationResult, Options
from lpc_mdo.optimization.model import Evaluate
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import analysis_file, result_file, trace
from lpc_mdo.stored.result import Result
from lpc_mdo.studies import study_file
from lpc_mdo.studies.single import solve
from lpc_mdo.studies.study import Study

FAULTS = (ValueError, ArithmeticError, RuntimeError)  # what a point may fail of without ending the study


@dataclass(frozen=True)
class Neighbour:
    """An optimum next to a point: its variables in SI units and its multipliers in engineering units, by name."""

    design: dict[str, Any]
    multipliers: dict[str, Any]


@dataclass(frozen=True)
class Task:
    """One point for one worker, with the result from which it starts and that one's folder; None: the baseline."""

    point: int
    start: Neighbour | None
    origin: str | None


@dataclass(frozen=True)
class Outcome:
    """One point as it goes to its folder: its entry, and the texts of its other files by name, none where it failed."""

    point: int
    entry: dict[str, Any]
    files: dict[str, str]


Land = Callable[[Outcome], None]
Lose = Callable[[Task, Exception], None]


@dataclass(frozen=True)
class Work:
    """What is done at every point; called with a task, it gives the outcome. It travels to other processes."""

    study: Study
    solver: str
    options: Options

    @one_thread()
    def __call__(self, task: Task) -> Outcome:
        """Solve a point; one that fails has an outcome too, which says why."""
        wall, processor = time.monotonic(), time.process_time()
        try:
            (problem,) = self.study.problems([self.study.values[task.point]])
            searched = search(self, task, problem, started=wall)
            if searched.found.status == "interrupted":  # not a result: a resumed study solves this point again
                raise KeyboardInterrupt
            spent = {"wall": time.monotonic() - wall, "processor": time.process_time() - processor}
            return outcome_of(self.study, task, problem, searched, spent)
        except FAULTS as error:
            return failed(self.study, task, error)


@dataclass(frozen=True)
class Searched:
    """Where the search at a point ended: the solver's result, the same in engineering terms, and the designs looked at."""

    found: OptimizationResult
    result: Result
    looked_at: trace.Trace


def search(
    work: Work, task: Task, problem: Problem, evaluate: Evaluate | None = None, started: float | None = None
) -> Searched:
    """Solve the point's problem; `evaluate`: asked in place of the problem's own, as by a hub; started: time.monotonic()."""
    x0, multipliers = _start(problem, task.start)
    looked_at = trace.Trace(problem)
    found, result = solve(
        problem,
        x0,
        solver=work.solver,
        options=work.options,
        hooks=Hooks(evaluation=looked_at.add),
        multipliers=multipliers,
        evaluate=evaluate,
        started=started,
    )
    return Searched(found, result, looked_at)


def outcome_of(study: Study, task: Task, problem: Problem, searched: Searched, spent: dict[str, float]) -> Outcome:
    """A solved point as it goes to its folder; spent: wall and processor time, s."""
    value, found, result = study.values[task.point], searched.found, searched.result
    content = result.content()
    slope = study.slope(value, problem, found.x, found.multipliers) if result.is_converged else None
    entry = study_file.entry_of(study, task.point, content, slope)
    entry["time_s"] = spent
    entry["start"] = task.origin
    whole = problem.analyze_design
    configuration = result_file.configuration(whole.vehicle, whole.mission, problem.settings)
    files = {
        "configuration.json": study_file.json_text(configuration),
        "history.csv": result_file.history_text(found, problem),
        trace.FILE: searched.looked_at.text(),
        analysis_file.FILE: analysis_file.text(analysis_file.build(problem, found)),
        "result.json": study_file.json_text(content),
    }
    return Outcome(task.point, entry, files)


def _start(problem: Problem, neighbour: Neighbour | None) -> tuple[Tensor, Tensor | None]:
    """Scaled x (n,) and multipliers (m,) to start from; no multipliers where the start is the baseline."""
    if neighbour is None:
        return problem.x0, None
    return problem.scaled(neighbour.design), multipliers_of(problem, neighbour.multipliers)


def multipliers_of(problem: Problem, stored: dict[str, Any]) -> Tensor:
    """Multipliers (m,) of the problem's scaled rows from those in engineering units by row, as results carry them."""
    rows = [
        torch.as_tensor(stored[row.name], dtype=torch.float64).reshape(-1) * (row.scale / problem.objective.scale)
        for row in problem.constraints
    ]
    return torch.cat(rows)


def failed(study: Study, task: Task, error: Exception) -> Outcome:
    """The outcome of a point without a result."""
    entry = study_file.empty_entry(study, task.point, "failed", f"{type(error).__name__}: {error}")
    entry["start"] = task.origin
    return Outcome(task.point, entry, {})
