"""One thread for the work itself: arrays of this model are so small that threads wait for each other longer than they work."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits


@contextmanager
def one_thread() -> Iterator[None]:
    """Within it, or within a function that it decorates, torch, BLAS and OpenMP use one thread; afterwards as many as before.

    Sums then have the same order, and results the same bits, however many processors there are.
    """
    torch = sys.modules.get("torch")  # reports are drawn without it, and sooner
    before = torch.get_num_threads() if torch else 0
    with threadpool_limits(limits=1):
        if torch:
            torch.set_num_threads(1)
        try:
            yield
        finally:
            if torch:
                torch.set_num_threads(before)
