"""Points of a study solved side by side in one process, or in several: what they ask of their model is answered in batches."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization.evaluator import Evaluate
from lpc_mdo.optimization.hub import Ending, Hub
from lpc_mdo.problems.problem import Problem
from lpc_mdo.stored.result import Timing
from lpc_mdo.studies.executors import InProcess, Processes
from lpc_mdo.studies.points import FAULTS, Land, Lose, Outcome, Searched, Task, Work, failed, outcome_of, search
from lpc_mdo.studies.together import are_alike, shared_evaluate


@dataclass(frozen=True)
class Lockstep:
    """All points of a study from their own starts, `size` at a time in one hub, `jobs` hubs side by side.

    Each is solved as it is alone, by the same solver; points with an analysis of their own are run alone.
    """

    is_together: ClassVar[bool] = True
    size: int
    jobs: int = 1

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        alone = Processes(self.jobs) if self.jobs > 1 else InProcess()
        if len(tasks) < 2:
            return alone.run(work, tasks, land, lose)
        count = -(-len(tasks) // self.size)  # hubs, as even as can be, whatever the number of processes
        batches = [tasks[i::count] for i in range(count)]
        if self.jobs == 1:
            for batch in batches:
                solve_batch(work, batch, land)
            return 0.0
        spent, left = self._in_processes(work, batches, land)
        return spent + (alone.run(work, left, land, lose) if left else 0.0)

    def _in_processes(self, work: Work, batches: list[list[Task]], land: Land) -> tuple[float, list[Task]]:
        """Processor time, s, and the tasks of a batch whose process died: run alone, the one to blame shows."""
        from joblib import delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        from lpc_mdo.numerics.workers import side_by_side

        spent, left = 0.0, {batch[0].point: batch for batch in batches}
        try:
            calls = (delayed(_outcomes)(work, batch) for batch in batches)
            for outcomes, processor, key in side_by_side(self.jobs, calls):
                spent += processor
                del left[key]
                for outcome in outcomes:
                    land(outcome)
        except TerminatedWorkerError:
            return spent, [task for batch in left.values() for task in batch]
        return spent, []


def _outcomes(work: Work, tasks: list[Task]) -> tuple[list[Outcome], float, int]:
    """What travels back from another process: outcomes, processor time, s, and the first task's point."""
    begun = time.process_time()
    outcomes: list[Outcome] = []
    solve_batch(work, tasks, outcomes.append)
    return outcomes, time.process_time() - begun, tasks[0].point


@one_thread()
def solve_batch(work: Work, tasks: list[Task], land: Land) -> None:
    """Solve the tasks side by side and land each outcome as it is there. Raises KeyboardInterrupt where one was stopped."""
    keep_freed_memory()
    for part in _alike(work, tasks, land):
        _solve_alike(work, part, land)


def _alike(work: Work, tasks: list[Task], land: Land) -> Iterator[list[tuple[Task, Problem]]]:
    """Tasks with their problems, in parts that share their analysis; one that has no problem lands as failed."""
    parts: list[list[tuple[Task, Problem]]] = []
    for task in tasks:
        try:
            (problem,) = work.study.problems([work.study.values[task.point]])
        except FAULTS as error:
            land(failed(work.study, task, error))
            continue
        part = next((part for part in parts if are_alike(problem, part[0][1])), None)
        if part is None:
            parts.append(part := [])
        part.append((task, problem))
    return iter(parts)


def _solve_alike(work: Work, pairs: list[tuple[Task, Problem]], land: Land) -> None:
    is_stopped = False

    def searched(i: int, evaluate: Evaluate) -> Searched:
        task, problem = pairs[i]
        return search(work, task, problem, evaluate)

    def ended(i: int, ending: Ending[Searched]) -> None:
        nonlocal is_stopped
        task, problem = pairs[i]
        if isinstance(ending.error, KeyboardInterrupt) or (
            ending.result and ending.result.result.status == "interrupted"
        ):
            is_stopped = True
            return
        try:
            searched, spent = ending.unwrap(), {"wall": ending.wall, "processor": ending.processor}
            timing = Timing.model_construct(total_s=ending.wall, setup_s=0.0, optimize_s=ending.wall, report_s=0.0)
            shared = replace(searched, result=searched.result.model_copy(update={"timing": timing}))
            outcome = outcome_of(work.study, task, problem, shared, spent)
        except FAULTS as error:
            outcome = failed(work.study, task, error)
        land(outcome)

    Hub(shared_evaluate([problem for _, problem in pairs]), searched, len(pairs), ended).run()
    if is_stopped:
        raise KeyboardInterrupt
