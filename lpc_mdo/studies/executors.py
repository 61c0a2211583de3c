"""Where the points of a study run: in this process, in processes of this machine (joblib), on a Dask cluster."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from lpc_mdo.config import ConfigurationError
from lpc_mdo.studies.runner import Land, Lose, Outcome, Task

Work = Callable[[Task], Outcome]


@dataclass(frozen=True)
class InProcess:
    """One task after the other, here."""

    is_together: ClassVar[bool] = False

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        for task in tasks:
            land(work(task))
        return 0.0


@dataclass(frozen=True)
class Processes:
    """Processes of this machine by joblib."""

    is_together: ClassVar[bool] = False
    count: int

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        if not tasks:
            return 0.0
        parallel = Parallel(n_jobs=self.count, return_as="generator_unordered", batch_size=1)
        spent, left = 0.0, {task.point: task for task in tasks}
        try:
            for outcome, processor, told in parallel(delayed(timed)(work, task) for task in tasks):
                spent += processor
                _repeat(told)
                del left[outcome.point]
                land(outcome)
        except TerminatedWorkerError as error:
            for task in left.values():
                lose(task, error)
        return spent


class Cluster:
    """A running Dask cluster; a task of a lost worker is run again by another one."""

    is_together: ClassVar[bool] = False

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

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        from distributed import KilledWorker, as_completed

        futures = {self.client.submit(timed, work, task, pure=False): task for task in tasks}
        spent = 0.0
        for future in as_completed(futures, loop=self.client.loop):
            try:
                outcome, processor, told = future.result()
            except KilledWorker as error:  # it took several workers down
                lose(futures[future], error)
                continue
            spent += processor
            _repeat(told)
            land(outcome)
        return spent

    def close(self) -> None:
        self.client.close()


def timed(work: Work, task: Task) -> tuple[Outcome, float, list[str]]:
    """What travels back from another process: the outcome of a task, its processor time, s, and the warnings it gave."""
    begun = time.process_time()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("once")
        outcome = work(task)
    return outcome, time.process_time() - begun, list(dict.fromkeys(str(warning.message) for warning in caught))


def _repeat(told: list[str]) -> None:
    """Give the warnings of another process here, where the command line shows each once."""
    for message in told:
        warnings.warn(message, RuntimeWarning, stacklevel=2)
