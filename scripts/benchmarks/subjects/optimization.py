"""One optimization by the command that users call, from the start of the process to the written result."""

import json
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchmarks.subject import Task


def prepare(solver: str, formulation: str, time_limit: float) -> Task:
    """run: the command; check: the parts of the result.json of the last run that a comparison shows."""
    shown: dict[str, Any] = {}

    def run() -> None:
        from lpc_mdo.cli import main

        with tempfile.TemporaryDirectory() as folder:
            options = ["--solver", solver, "--formulation", formulation, "--time-limit", str(time_limit)]
            with suppress(SystemExit):  # also where the solver did not converge; the result says so
                main(["optimize", *options, "--quiet", "--output", folder])
            result = json.loads((Path(folder) / "result.json").read_text(encoding="utf-8"))
        shown.update({name: result[name] for name in ("status", "objective", "counts", "timing", "certificate")})

    return Task(run, lambda: shown)
