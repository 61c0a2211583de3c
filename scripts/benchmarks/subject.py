"""What a benchmark measures: a task that one process prepares once and then runs as often as it is told to."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

INSTALL = "pip install 'lpc-mdo[bench]'"


@dataclass(frozen=True)
class Task:
    """run: what is timed; check: what it computes, as JSON can hold it, to compare codes by."""

    run: Callable[[], object]
    check: Callable[[], dict[str, Any]] = field(default=lambda: {})


@dataclass(frozen=True)
class Subject:
    """target "module:function", called with `arguments`, prepares a Task; `package` must be importable for it."""

    label: str
    target: str
    arguments: dict[str, Any] = field(default_factory=dict)
    package: str = "lpc_mdo"

    @property
    def is_installed(self) -> bool:
        return find_spec(self.package) is not None
