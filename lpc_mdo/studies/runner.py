"""Runs a study: neighbours start each other, points run side by side, land as they finish, and are never run twice."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import torch

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked, write_atomically
from lpc_mdo.numerics.present import present
from lpc_mdo.optimization import Options
from lpc_mdo.problems.problem import Problem
from lpc_mdo.stored import study as stored_study
from lpc_mdo.stored.result import design_of, read_result
from lpc_mdo.studies import study_file
from lpc_mdo.studies.points import Land, Lose, Neighbour, Outcome, Task, Work, failed
from lpc_mdo.studies.study import Study, generations

BETTER = 1e-6  # of 1 + |objective|, scaled: a neighbour's design that is better by more shows a merely local optimum
FEASIBLE = 1e-6  # largest scaled violation of a design that counts as feasible
ROUNDS = 3  # of runs again from a neighbour's better design


class Executor(Protocol):
    """Where tasks run: this process, processes of this machine, a cluster (executors.py), one hub (lockstep.py).

    is_together: all points at once from the baseline, none from its neighbour.
    """

    @property
    def is_together(self) -> bool: ...

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        """Run every task; land its outcome here, or lose it with its worker.

        Returns the processor time, s, spent in other processes.
        """


def require_study_folder(folder: Path, is_resuming: bool) -> None:
    """Raises ConfigurationError if the folder is none, holds a study that is not to be resumed, or a single run."""
    place = f"--output {folder} is not allowed; it"
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{place} exists and is not a folder.")
    if (folder / stored_study.FILE).exists() and not is_resuming:
        raise ConfigurationError(f"{place} holds a study: add --resume or name another folder.")
    if (folder / "result.json").exists():
        raise ConfigurationError(f"{place} holds a single run: name another folder.")


def require_own_folder(folder: Path, is_resuming: bool, study: Study, solver: str) -> None:
    """What a run of the study would refuse, before anything else runs: raises ConfigurationError as `require_study_folder`,
    and for points of another study."""
    require_study_folder(folder, is_resuming)
    if (folder / stored_study.FILE).exists():
        study_file.read_points(study, folder, study_file.identity(study, solver))


class StudyRun:
    """One run of a study in its folder."""

    def __init__(
        self,
        study: Study,
        folder: Path,
        executor: Executor,
        solver: str = "sqp",
        options: Options | None = None,
        report: Callable[[dict[str, Any], int], None] = lambda entry, left: None,
    ) -> None:
        """report: called with the entry of every point that lands and the number of points that are left."""
        self.study, self.folder, self.executor, self.report = study, folder, executor, report
        self.key = study_file.identity(study, solver)
        self.work = Work(study, solver, options or Options())
        self.entries: list[dict[str, Any] | None] = [None] * len(study.values)
        self.started, self.processor_started, self.elsewhere = time.monotonic(), time.process_time(), 0.0
        self.before = {"wall_s": 0.0, "processor_s": 0.0}

    def run(self, is_resuming: bool = False) -> dict[str, Any]:
        """Run every point that has no result yet; returns the content of study.json.

        Raises ConfigurationError if the folder holds a study and is_resuming is False, another study, or a run, or if another
        process works there.
        """
        require_study_folder(self.folder, is_resuming)
        with locked(self.folder):
            return self._run(is_resuming)

    def _run(self, is_resuming: bool) -> dict[str, Any]:
        self._prepare(is_resuming)
        starts = (None,) * len(self.study.values) if self.executor.is_together else self.study.origins
        for wave in generations(starts):
            pending = {i: self._origin(i, starts) for i in wave if self.entries[i] is None}
            self._execute(pending, self._land)
            # A neighbour may be too far away, or in a valley that ends before this point.
            warm = [i for i, origin in pending.items() if origin is not None]
            missed = [i for i in warm if self._entry(i)["status"] != "converged"]
            self._execute(dict.fromkeys(missed), self._land_if_certified)
        if self.study.kind != "starts":  # where a neighbour's better design would hide the worse optimum
            self._improve()
        return self._write()

    def _prepare(self, is_resuming: bool) -> None:
        file = self.folder / stored_study.FILE
        require_study_folder(self.folder, is_resuming)
        if file.exists():
            self.entries = study_file.read_points(self.study, self.folder, self.key)
            self.before = stored_study.read_study_file(file)["timing"]
        self._write()

    def _origin(self, point: int, starts: tuple[int | None, ...]) -> int | None:
        """The nearest point up the line of starts that converged; None: the baseline."""
        origin = starts[point]
        while origin is not None and self._entry(origin)["status"] != "converged":
            origin = starts[origin]
        return origin

    def _execute(self, origins: dict[int, int | None], land: Land) -> None:
        tasks = [
            Task(point, self._neighbour(origin), None if origin is None else self._entry(origin)["folder"])
            for point, origin in origins.items()
        ]

        def lose(task: Task, error: Exception) -> None:
            land(failed(self.study, task, error))

        self.elsewhere += self.executor.run(self.work, tasks, land, lose)

    def _entry(self, point: int) -> dict[str, Any]:
        """Of a point that has landed."""
        return present(self.entries[point], f"point {point}")

    def _neighbour(self, point: int | None) -> Neighbour | None:
        if point is None:
            return None
        return self._solved(point)

    def _solved(self, point: int) -> Neighbour:
        result = read_result(self.folder / self._entry(point)["folder"] / "result.json")
        return Neighbour(design_of(result), {row["name"]: row["multiplier"] for row in result["constraints"]})

    def _land(self, outcome: Outcome) -> None:
        """Write the run folder, its point.json last: a point counts as done only when that is there."""
        folder = self.folder / outcome.entry["folder"]
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in outcome.files.items():
            write_atomically(folder / name, text)
        study_file.write_json(folder / stored_study.POINT_FILE, outcome.entry | {"study_sha256": self.key})
        self.entries[outcome.point] = outcome.entry
        self._write()
        self.report(outcome.entry, sum(entry is None for entry in self.entries))

    def _land_if_certified(self, outcome: Outcome) -> None:
        if outcome.entry["status"] == "converged":
            self._land(outcome)

    def _write(self) -> dict[str, Any]:
        timing = {
            "wall_s": self.before["wall_s"] + time.monotonic() - self.started,
            "processor_s": self.before["processor_s"] + time.process_time() - self.processor_started + self.elsewhere,
        }
        content = study_file.assemble(self.study, self.entries, timing)
        study_file.write_json(self.folder / stored_study.FILE, content)
        return content

    def _improve(self) -> None:
        """Run points again from a neighbour's design that is feasible and better for them: theirs was a local optimum."""
        certified = [i for i in range(len(self.entries)) if self._entry(i)["status"] == "converged"]
        problems = dict(zip(certified, self.study.problems([self.study.values[i] for i in certified]), strict=True))
        tried: set[tuple[int, int]] = set()

        def land_if_better(outcome: Outcome) -> None:
            is_better = outcome.entry["status"] == "converged" and (
                outcome.entry["objective"] < self._entry(outcome.point)["objective"]
            )
            if is_better:
                self._land(outcome)

        for _ in range(ROUNDS):
            found = {i: self._better_neighbour(i, problem) for i, problem in problems.items()}
            better: dict[int, int | None] = {i: j for i, j in found.items() if j is not None and (i, j) not in tried}
            if not better:
                return
            tried |= {(i, j) for i, j in better.items() if j is not None}
            self._execute(better, land_if_better)

    def _better_neighbour(self, point: int, problem: Problem) -> int | None:
        """The neighbour whose design is best for this point, if it is better than the point's own."""
        best = self._entry(point)["objective"] / problem.objective.scale
        best -= BETTER * (1.0 + abs(best))
        chosen: int | None = None
        for other in (point - 1, point + 1):
            if not 0 <= other < len(self.entries) or self._entry(other)["status"] != "converged":
                continue
            with torch.no_grad():
                objective, values = problem.evaluate(problem.scaled(self._solved(other).design))
            beyond = torch.maximum(problem.constraint_lower - values, values - problem.constraint_upper)
            if float(beyond.max()) <= FEASIBLE and float(objective) < best:
                best, chosen = float(objective), other
        return chosen
