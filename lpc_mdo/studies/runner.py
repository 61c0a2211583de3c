"""Runs a study: neighbours start each other, points run side by side, land as they finish, and are never run twice."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, read_json
from lpc_mdo.optimization import Options
from lpc_mdo.optimization.evaluator import Evaluate
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.files import write_atomically
from lpc_mdo.studies import study_file
from lpc_mdo.studies.lockstep import run_in_lockstep
from lpc_mdo.studies.single import solve
from lpc_mdo.studies.study import Study, generations, starting_points

BETTER = 1e-6  # of 1 + |objective|, scaled: a neighbour's design that is better by more shows a merely local optimum
FEASIBLE = 1e-6  # largest scaled violation of a design that counts as feasible
ROUNDS = 3  # of runs again from a neighbour's better design
FAULTS = (ValueError, ArithmeticError, RuntimeError)  # what a point may fail of without ending the study


@dataclass(frozen=True)
class Task:
    """Points for one worker, with the stored designs (by variable, SI) from which they start; None: the baseline."""

    points: tuple[int, ...]
    starts: tuple[dict[str, Any] | None, ...]
    origins: tuple[str | None, ...]  # folders of the starts, for the record


@dataclass(frozen=True)
class Outcome:
    """One point as it goes to its folder; `result` and `history` are None where the optimization failed."""

    point: int
    entry: dict[str, Any]
    result: dict[str, Any] | None
    history: str | None
    configuration: dict[str, Any] | None


Land = Callable[[Outcome], None]
Fail = Callable[[Task, Exception], None]


def run_task(study: Study, solver: str, options: Options, task: Task, land: Land) -> None:
    """Solve the points of a task, together where they share an analysis; land each as it finishes."""
    torch.set_num_threads(1)
    try:
        problems = study.problems([study.values[i] for i in task.points])
    except FAULTS as error:
        if len(task.points) == 1:
            land(_failed(study, task, 0, error))
        else:  # the value that is at fault must not fail the others
            for place in range(len(task.points)):
                alone = slice(place, place + 1)
                single = Task(task.points[alone], task.starts[alone], task.origins[alone])
                run_task(study, solver, options, single, land)
        return

    def run(place: int, evaluate: Evaluate | None) -> Outcome:
        return _solve(study, task, place, problems[place], evaluate, solver, options)

    def settle(place: int, outcome: Outcome | Exception) -> None:
        land(_failed(study, task, place, outcome) if isinstance(outcome, Exception) else outcome)

    if study.is_batched and len(problems) > 1:
        run_in_lockstep(problems, run, settle)
        return
    for place in range(len(problems)):
        try:
            settle(place, run(place, None))
        except FAULTS as error:
            settle(place, error)


def _solve(
    study: Study, task: Task, place: int, problem: Problem, evaluate: Evaluate | None, solver: str, options: Options
) -> Outcome:
    wall, processor = time.monotonic(), time.process_time()
    index = task.points[place]
    result, content = solve(
        problem, _start(problem, task.starts[place]), solver=solver, options=options, started=wall, evaluate=evaluate
    )
    if result.status == "interrupted":  # not a result: a resumed study solves this point again
        raise KeyboardInterrupt
    slope = None
    if result.status == "converged":
        slope = study.slope(study.values[index], problem, result.x, result.multipliers)
    entry = study_file.entry_of(study, index, content, slope)
    entry["time_s"] = {
        "wall": time.monotonic() - wall,
        "processor": time.process_time() - processor if evaluate is None else None,
    }
    entry["start"] = task.origins[place]
    whole = problem.analyze_design
    configuration = result_file.configuration(whole.vehicle, whole.mission, problem.settings)
    return Outcome(index, entry, content, result_file.history_text(result, problem), configuration)


def _start(problem: Problem, stored: dict[str, Any] | None) -> Tensor:
    """Where the optimization starts: the one place to hand over more than the neighbour's design."""
    return problem.x0 if stored is None else problem.scaled(stored)


def _failed(study: Study, task: Task, place: int, error: Exception) -> Outcome:
    index = task.points[place]
    entry = study_file.empty_entry(study, index, "failed", f"{type(error).__name__}: {error}")
    entry["start"] = task.origins[place]
    return Outcome(index, entry, None, None, None)


class Executor(Protocol):
    """Where tasks run: this process, processes of this machine, a cluster (executors.py)."""

    workers: int

    def run(self, work: Callable[[Task, Land], None], tasks: list[Task], land: Land, fail: Fail) -> float:
        """Run every task and land its outcomes here, or fail those whose worker is lost.

        Returns the processor time, s, spent in other processes.
        """


class StudyRun:
    """One run of a study in its folder."""

    def __init__(
        self,
        study: Study,
        folder: Path,
        executor: Executor,
        solver: str = "augmented-lagrangian",
        options: Options | None = None,
        report: Callable[[dict[str, Any], int], None] = lambda entry, left: None,
    ) -> None:
        """report: called with the entry of every point that lands and the number of points that are left."""
        self.study, self.folder, self.executor, self.report = study, folder, executor, report
        self.key = study_file.identity(study, solver)
        self.work = partial(run_task, study, solver, options or Options())
        self.entries: list[dict[str, Any] | None] = [None] * len(study.values)
        self.started, self.processor_started, self.elsewhere = time.monotonic(), time.process_time(), 0.0
        self.before = {"wall_s": 0.0, "processor_s": 0.0}

    def run(self, is_resuming: bool = False) -> dict[str, Any]:
        """Run every point that has no result yet; returns the content of study.json.

        Raises ConfigurationError if the folder holds a study and is_resuming is False, or another study.
        """
        self._prepare(is_resuming)
        starts = starting_points(len(self.study.values))
        for wave in generations(starts):
            pending = {i: self._origin(i, starts) for i in wave if self.entries[i] is None}
            self._execute(pending, self._land)
        self._improve()
        return self._write()

    def _prepare(self, is_resuming: bool) -> None:
        file = self.folder / study_file.STUDY_FILE
        if file.exists() and not is_resuming:
            raise ConfigurationError(
                f"--output {self.folder} is not allowed; it holds a study: add --resume or name another folder."
            )
        if file.exists():
            self.entries = study_file.read_points(self.study, self.folder, self.key)
            self.before = read_json(file)["timing"]
        self.folder.mkdir(parents=True, exist_ok=True)
        self._write()

    def _origin(self, point: int, starts: tuple[int | None, ...]) -> int | None:
        """The nearest point up the line of starts that has a design; None: the baseline."""
        origin = starts[point]
        while origin is not None and (self.entries[origin] is None or self.entries[origin]["status"] == "failed"):
            origin = starts[origin]
        return origin

    def _execute(self, origins: dict[int, int | None], land: Land) -> None:
        points = list(origins)
        if not points:
            return
        size = -(-len(points) // self.executor.workers) if self.study.is_batched else 1
        tasks = []
        for first in range(0, len(points), size):
            chosen = points[first : first + size]
            tasks.append(
                Task(
                    points=tuple(chosen),
                    starts=tuple(self._design(origins[i]) for i in chosen),
                    origins=tuple(None if origins[i] is None else self.entries[origins[i]]["folder"] for i in chosen),
                )
            )

        def fail(task: Task, error: Exception) -> None:
            for place in range(len(task.points)):
                land(_failed(self.study, task, place, error))

        self.elsewhere += self.executor.run(self.work, tasks, land, fail)

    def _design(self, point: int | None) -> dict[str, Any] | None:
        if point is None:
            return None
        result = read_json(self.folder / self.entries[point]["folder"] / "result.json")
        return {variable["name"]: variable["value"] for variable in result["design_variables"]}

    def _land(self, outcome: Outcome) -> None:
        """Write the run folder, its point.json last: a point counts as done only when that is there."""
        folder = self.folder / outcome.entry["folder"]
        folder.mkdir(parents=True, exist_ok=True)
        if outcome.result is not None:
            study_file.write_json(folder / "configuration.json", outcome.configuration)
            write_atomically(folder / "history.csv", outcome.history)
            result_file.write_result(outcome.result, folder)
        study_file.write_json(folder / study_file.POINT_FILE, outcome.entry | {"study_sha256": self.key})
        self.entries[outcome.point] = outcome.entry
        self._write()
        self.report(outcome.entry, sum(entry is None for entry in self.entries))

    def _write(self) -> dict[str, Any]:
        timing = {
            "wall_s": self.before["wall_s"] + time.monotonic() - self.started,
            "processor_s": self.before["processor_s"] + time.process_time() - self.processor_started + self.elsewhere,
        }
        content = study_file.assemble(self.study, self.entries, timing)
        study_file.write_json(self.folder / study_file.STUDY_FILE, content)
        return content

    def _improve(self) -> None:
        """Run points again from a neighbour's design that is feasible and better for them: theirs was a local optimum."""
        certified = [i for i, entry in enumerate(self.entries) if entry["status"] == "converged"]
        problems = dict(zip(certified, self.study.problems([self.study.values[i] for i in certified]), strict=True))
        tried: set[tuple[int, int]] = set()

        def land_if_better(outcome: Outcome) -> None:
            is_better = outcome.entry["status"] == "converged" and (
                outcome.entry["objective"] < self.entries[outcome.point]["objective"]
            )
            if is_better:
                self._land(outcome)

        for _ in range(ROUNDS):
            found = {i: self._better_neighbour(i, problem) for i, problem in problems.items()}
            better = {i: j for i, j in found.items() if j is not None and (i, j) not in tried}
            if not better:
                return
            tried |= set(better.items())
            self._execute(better, land_if_better)

    def _better_neighbour(self, point: int, problem: Problem) -> int | None:
        """The neighbour whose design is best for this point, if it is better than the point's own."""
        best = self.entries[point]["objective"] / problem.objective.scale
        best -= BETTER * (1.0 + abs(best))
        chosen = None
        for other in (point - 1, point + 1):
            if not 0 <= other < len(self.entries) or self.entries[other]["status"] != "converged":
                continue
            with torch.no_grad():
                objective, values = problem.evaluate(problem.scaled(self._design(other)))
            beyond = torch.maximum(problem.constraint_lower - values, values - problem.constraint_upper)
            if float(beyond.max()) <= FEASIBLE and float(objective) < best:
                best, chosen = float(objective), other
        return chosen
