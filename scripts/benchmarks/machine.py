"""What a benchmark ran on."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = (
    "lpc-mdo",
    "torch",
    "numpy",
    "scipy",
    "AeroSandbox",
    "casadi",
    "openaerostruct",
    "openmdao",
    "wisdem",
    "NeuralFoil",
)


def description() -> str:
    """Processor, its load before the run, threads and versions, in one paragraph."""
    load = os.getloadavg()[0]
    state = "busy with other work: times are too long, ratios hold" if load > 0.5 else "idle before the run"
    return (
        f"{_processor()}, {os.cpu_count()} cores, one thread for every code, load average {load:.1f} ({state}). "
        f"Python {platform.python_version()}, {', '.join(f'{name} {_version(name)}' for name in PACKAGES)}. "
        "Times are the median processor time of a run, the codes' runs taking turns; memory is the largest that a process of "
        "its own held, its packages and, for derivatives built beforehand, their building included."
    )


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    lines = information.read_text(encoding="utf-8").splitlines() if information.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
