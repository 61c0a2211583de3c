"""Where the points of a study run: in this process, in processes of this machine (joblib), on a Dask cluster."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from lpc_mdo.config import ConfigurationError
from lpc_mdo.studies.runner import Fail, Land, Outcome, Task

Work = Callable[[Task, Land], None]


@dataclass(frozen=True)
class InProcess:
    """One task after the other, here."""

    workers: int = 1

    def run(self, work: Work, tasks: list[Task], land: Land, fail: Fail) -> float:
        for task in tasks:
            work(task, land)
        return 0.0


@dataclass(frozen=True)
class Processes:
    """Processes of this machine by joblib."""

    workers: int

    def run(self, work: Work, tasks: list[Task], land: Land, fail: Fail) -> float:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        parallel = Parallel(n_jobs=self.workers, return_as="generator_unordered", batch_size=1)
        spent, left = 0.0, dict(enumerate(tasks))
        try:
            for number, outcomes, processor in parallel(delayed(_numbered)(i, work, t) for i, t in enumerate(tasks)):
                spent += processor
                del left[number]
                for outcome in outcomes:
                    land(outcome)
        except TerminatedWorkerError as error:
            for task in left.values():
                fail(task, error)
        return spent


class Cluster:
    """A running Dask cluster; a task of a lost worker is run again by another one."""

    def __init__(self, address: str) -> None:
        """Connect. Raises ConfigurationError if the extra is not installed, or nobody answers at the address."""
        try:
            from distributed import Client
        except ImportError:
            raise ConfigurationError("--cluster needs the extra: pip install 'lpc-mdo[cluster]'.") from None
        try:
            self.client = Client(address, timeout=10, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise ConfigurationError(f"--cluster {address} is not allowed; no scheduler answers: {error}.") from None

    @property
    def workers(self) -> int:
        return max(1, sum(self.client.nthreads().values()))

    def run(self, work: Work, tasks: list[Task], land: Land, fail: Fail) -> float:
        from distributed import KilledWorker, as_completed

        futures = {self.client.submit(collect, work, task, pure=False): task for task in tasks}
        spent = 0.0
        for future in as_completed(futures, loop=self.client.loop):
            try:
                outcomes, processor = future.result()
            except KilledWorker as error:  # it took several workers down
                fail(futures[future], error)
                continue
            spent += processor
            for outcome in outcomes:
                land(outcome)
        return spent

    def close(self) -> None:
        self.client.close()


def collect(work: Work, task: Task) -> tuple[list[Outcome], float]:
    """The outcomes of a task and its processor time, s: what travels back from another process."""
    begun = time.process_time()
    outcomes: list[Outcome] = []
    work(task, outcomes.append)
    return outcomes, time.process_time() - begun


def _numbered(number: int, work: Work, task: Task) -> tuple[int, list[Outcome], float]:
    return number, *collect(work, task)
