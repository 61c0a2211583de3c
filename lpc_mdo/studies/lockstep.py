"""Points of a study in one batch, or in several side by side: what they share is computed once for all of a batch."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

from torch import Tensor

from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import Options
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.studies.executors import InProcess, Processes
from lpc_mdo.studies.runner import FAULTS, Land, Lose, Outcome, Task, outcome_of
from lpc_mdo.studies.study import Study
from lpc_mdo.studies.together import solve_together

SERVES = ("augmented-lagrangian", "sqp")  # whose optima a batch finds, by a loop like theirs


@dataclass(frozen=True)
class Lockstep:
    """All points of a study from their own starts, `size` at a time in one batch, `jobs` batches side by side.

    Points that start from a neighbour, or that a batch leaves without a certificate, are run alone.
    """

    is_together: ClassVar[bool] = True
    study: Study
    options: Options
    size: int
    jobs: int = 1

    def run(self, work: Callable[[Task], Outcome], tasks: list[Task], land: Land, lose: Lose) -> float:
        alone = Processes(self.jobs) if self.jobs > 1 else InProcess()
        together = [task for task in tasks if task.start is None]
        if len(together) < 2:
            return alone.run(work, tasks, land, lose)
        count = -(-len(together) // self.size)  # batches, as even as can be
        batches = [together[i::count] for i in range(count)]
        left, spent = [task for task in tasks if task.start is not None], 0.0
        for outcomes, batch, processor in self._solved(batches):
            spent += processor
            by_point = {outcome.point: outcome for outcome in outcomes}
            for task in batch:
                outcome = by_point.get(task.point)
                if outcome is not None and outcome.entry["status"] == "converged":
                    land(outcome)
                else:
                    left.append(task)
        return spent + (alone.run(work, left, land, lose) if left else 0.0)

    def _solved(self, batches: list[list[Task]]) -> Iterator[tuple[list[Outcome], list[Task], float]]:
        """Outcomes of batches as they are done, with processor time, s, spent in other processes.

        A batch whose process dies is not among them: its points are run alone, where the one to blame shows.
        """
        if self.jobs == 1:
            for batch in batches:
                yield solve_batch(self.study, self.options, batch)[0], batch, 0.0
            return
        from joblib import delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        from lpc_mdo.numerics.workers import side_by_side

        left = {batch[0].point: batch for batch in batches}
        try:
            for outcomes, processor, key in side_by_side(
                self.jobs, (delayed(solve_batch)(self.study, self.options, batch) for batch in batches)
            ):
                yield outcomes, left.pop(key), processor
        except TerminatedWorkerError:
            for batch in left.values():
                yield [], batch, 0.0


@one_thread()
def solve_batch(study: Study, options: Options, tasks: list[Task]) -> tuple[list[Outcome], float, int]:
    """Outcomes of the tasks, processor time, s, and the first one's point; none where one of them has no problem.

    Each point's time is that of the batch over the number of points.
    """
    keep_freed_memory()
    wall, processor = time.monotonic(), time.process_time()
    try:
        problems = study.problems([study.values[task.point] for task in tasks])
        traces = [Trace(problem) for problem in problems]

        def observe(which: Tensor, objective: Tensor, constraints: Tensor) -> None:
            for i, *values in zip(which.tolist(), objective, constraints, strict=True):
                traces[i].add(*values)

        results = solve_together(problems, options, observe)
        share = 1.0 / len(tasks)
        spent = {"wall": share * (time.monotonic() - wall), "processor": share * (time.process_time() - processor)}
        timing = {"total_s": spent["wall"], "setup_s": 0.0, "optimize_s": spent["wall"], "report_s": 0.0}
        outcomes = []
        for task, problem, result, trace in zip(tasks, problems, results, traces, strict=True):
            whole = problem.analyze_design
            content = result_file.build(problem, result, whole.vehicle, whole.mission, options, timing)
            outcomes.append(outcome_of(study, task, problem, result, content, trace, spent))
    except FAULTS:  # each of them tells for itself when it is run alone
        outcomes = []
    return outcomes, time.process_time() - processor, tasks[0].point
