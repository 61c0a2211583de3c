"""One thread for the work itself: arrays of this model are so small that threads wait for each other longer than they work."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Within it, or within a function that it decorates, torch, BLAS and OpenMP use one thread; afterwards as many as before.

    Sums then have the same order, and results the same bits, however many processors there are.
    """
    before = torch.get_num_threads()
    with threadpool_limits(limits=1):
        torch.set_num_threads(1)
        try:
            yield
        finally:
            torch.set_num_threads(before)
