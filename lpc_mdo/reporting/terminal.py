"""The terminal: text as it stands, without markup, and a reader that goes away does not end the work."""

import errno
import sys
from collections.abc import Callable
from typing import Any, TextIO

from rich.console import Console


class PatientStream:
    """A text stream that shows "?" for what its encoding lacks, and keeps silent once nobody takes what it writes."""

    def __init__(self, stream: TextIO) -> None:
        self.stream, self.is_broken = stream, False
        self.encoding = getattr(stream, "encoding", None) or "utf-8"

    def write(self, text: str) -> int:
        self._try(lambda: self.stream.write(text.encode(self.encoding, "replace").decode(self.encoding)))
        return len(text)

    def flush(self) -> None:
        self._try(self.stream.flush)

    def _try(self, action: Callable[[], object]) -> None:
        if self.is_broken:
            return
        try:
            action()
        except (OSError, ValueError) as error:  # ValueError: the stream is closed
            self.is_broken = True
            if isinstance(error, OSError) and error.errno != errno.EPIPE:
                print(f"lpc-mdo: the display ends here: {error.strerror}; the work goes on", file=sys.stderr)

    def isatty(self) -> bool:
        return self.stream.isatty()

    def fileno(self) -> int:
        return self.stream.fileno()


def terminal(is_quiet: bool = False, is_error: bool = False, width: int | None = None) -> Console:
    """A console on standard output (or error) that prints brackets, colons and names as they are."""
    stream: Any = PatientStream(sys.stderr if is_error else sys.stdout)
    return Console(file=stream, quiet=is_quiet, width=width, markup=False, emoji=False)
