"""Differentiable design of NASA's Lift+Cruise electric air taxi."""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "baseline": "lpc_mdo.config",
    "load": "lpc_mdo.config",
    "Vehicle": "lpc_mdo.config",
    "Mission": "lpc_mdo.config",
    "gross_weight_problem": "lpc_mdo.problems.gross_weight",
    "one_thread": "lpc_mdo.numerics.threads",
    "optimize": "lpc_mdo.studies.runs",
    "Result": "lpc_mdo.stored.result",
}

__all__ = list(_PUBLIC)


def __getattr__(name: str) -> Any:
    """Import on first use: `lpc-mdo --help` must not wait for torch."""
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module 'lpc_mdo' has no attribute {name!r}")
