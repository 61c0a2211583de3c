"""Where the points of a study run: in this process, in processes of this machine (joblib), on a Dask cluster."""

import contextlib
import logging
import re
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.studies.points import Land, Lose, Outcome, Task, Work

LOOK_EVERY = 5.0  # s between looks for scheduler and workers of a cluster
PATIENCE = 300.0  # s for which a cluster without workers is waited for: a nanny or a queue has given one by then


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
        from joblib import delayed
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        from lpc_mdo.numerics.workers import side_by_side

        if not tasks:
            return 0.0
        spent, left = 0.0, {task.point: task for task in tasks}
        try:
            for outcome, processor, told in side_by_side(self.count, (delayed(timed)(work, task) for task in tasks)):
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
        """Connect. Raises ConfigurationError for no address, if the extra is not installed, or if nobody answers there."""
        if not re.fullmatch(r"\S+:\d+|inproc://\S+", address):  # Dask would go on trying
            raise ConfigurationError(f"--cluster {address!r} is invalid: it must be HOST:PORT, e.g. tcp://host:8786.")
        try:
            from distributed import Client
        except ImportError:
            raise ConfigurationError("--cluster needs the extra: pip install 'lpc-mdo[cluster]'.") from None
        self.address = address
        try:
            self.client = Client(address, timeout=10, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise ConfigurationError(f"--cluster {address} is not allowed; no scheduler answers: {error}.") from None

    def run(self, work: Work, tasks: list[Task], land: Land, lose: Lose) -> float:
        from distributed import KilledWorker

        futures = {self.client.submit(timed, work, task, pure=False): task for task in tasks}
        spent = 0.0
        for future in self._done(set(futures)):
            try:
                outcome, processor, told = future.result()
            except KilledWorker as error:  # it took several workers down
                lose(futures[future], error)
                continue
            spent += processor
            _repeat(told)
            land(outcome)
        return spent

    def _done(self, waiting: set[Any]) -> Iterator[Any]:
        """Futures as they are done. Tells if all workers are gone; raises ConnectionError if none comes within PATIENCE, or if
        the scheduler is gone."""
        from distributed import CancelledError, wait
        from distributed import TimeoutError as NothingYet

        alone_since = None
        while waiting:
            try:
                with self.client.as_current():
                    done = wait(waiting, timeout=LOOK_EVERY, return_when="FIRST_COMPLETED").done
            except NothingYet:
                done = set()
            except CancelledError:
                done = waiting
            if self.client.status != "running" or any(future.cancelled() for future in done):
                raise ConnectionError(
                    f"--cluster {self.address}: the scheduler is gone; finished points are kept: add --resume to go on"
                )
            if done or self.client.scheduler_info().get("workers"):
                waiting -= done
                alone_since = None
                yield from done
            elif alone_since is None:
                alone_since = time.monotonic()
                warnings.warn(
                    f"--cluster {self.address} has no workers; waiting for one, {PATIENCE:g} s at most", stacklevel=2
                )
            elif time.monotonic() - alone_since > PATIENCE:
                raise ConnectionError(
                    f"--cluster {self.address}: no worker came within {PATIENCE:g} s; finished points are kept: add --resume to "
                    "go on"
                )

    def close(self) -> None:
        """Leave the cluster; what the client has to say of a scheduler that is gone has been said in a sentence."""
        with _silent("distributed.client", "distributed.utils", "distributed.core"):
            self.client.close()


@contextlib.contextmanager
def _silent(*loggers: str) -> Iterator[None]:
    """Without the messages of these loggers, which keep their level for afterwards."""
    levels = {logging.getLogger(name): logging.getLogger(name).level for name in loggers}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


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
