"""Processes of this machine that work side by side, and end when the process that asked for them ends, whatever ends it."""

import os
import signal
import threading
import time
import warnings
from collections.abc import Iterable, Iterator
from typing import Any

from joblib import Parallel, parallel_config

LOOK_EVERY = 0.5  # s between looks for the parent


def side_by_side(jobs: int, calls: Iterable[Any], is_ordered: bool = False) -> Iterator[Any]:
    """Results of calls (made with joblib.delayed) as they are done, or in order, from `jobs` processes of one thread each, or
    fewer: no more than there are calls, since all are started at once.

    Raises joblib's TerminatedWorkerError if a process dies. Leaving the iterator early ends the processes.
    """
    calls = list(calls)
    with parallel_config(backend="loky", inner_max_num_threads=1):
        work = Parallel(
            n_jobs=min(jobs, max(2, len(calls))),  # one alone would work in this process
            return_as="generator" if is_ordered else "generator_unordered",
            batch_size=1,
            max_nbytes=None,  # no files of shared memory that a killed process would leave behind
            initializer=end_with,
            initargs=(os.getpid(),),
        )
        results = work(calls)
        try:
            yield from results
        finally:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # joblib's, of calls that nobody wants any more
                results.close()


def end_with(parent: int) -> None:
    """End this process soon after its parent, and leave Ctrl-C to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY)
    os._exit(1)
