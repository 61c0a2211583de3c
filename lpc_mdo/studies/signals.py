"""Being asked to stop: a word at once, and what has been found so far is kept."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType

REQUESTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)


def stoppable(words: str) -> AbstractContextManager[None]:
    """Within it Ctrl-C, SIGTERM and SIGHUP say `words` on standard error and raise KeyboardInterrupt.

    A signal that is ignored (nohup, background jobs) or has a handler of the caller's own keeps that, and so do all of them
    in any thread but the main one.
    """

    def stop(count: int) -> None:
        if count == 1:
            _say(words)
        raise KeyboardInterrupt

    return _handled(stop)


def finishing(words: str) -> AbstractContextManager[None]:
    """As `stoppable`, but the first signal says `words` and changes nothing; the second raises KeyboardInterrupt."""

    def stop(count: int) -> None:
        if count > 1:
            raise KeyboardInterrupt
        _say(words)

    return _handled(stop)


@contextmanager
def _handled(stop: Callable[[int], None]) -> Iterator[None]:
    count = 0

    def handle(number: int, frame: FrameType | None) -> None:
        nonlocal count
        count += 1
        stop(count)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in REQUESTS}
    before = {number: handler for number, handler in before.items() if handler in DEFAULTS or hasattr(handler, OURS)}
    setattr(handle, OURS, True)
    for number in before:
        signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


OURS = "_of_lpc_mdo"  # marks our handlers, which one of ours may replace for a while


def _say(words: str) -> None:
    """Straight to the file descriptor: whatever was interrupted may be writing to the stream."""
    if sys.__stderr__ is None:
        return
    try:
        os.write(sys.__stderr__.fileno(), f"\nlpc-mdo: {words}\n".encode())
    except (OSError, ValueError):
        return  # nobody reads it
