"""Subjects side by side: each in a process of its own with one thread, their runs taking turns.

Taking turns, all meet the same load of the machine, so that ratios hold where times do not. This process stays small
(no torch): the system counts its memory as that of the processes that it starts.
"""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.subject import INSTALL, Subject

THREADS = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB")
FOLDER = str(Path(__file__).parents[1])
ENVIRONMENT = {f"{name}_NUM_THREADS": "1" for name in THREADS} | {"OPENMDAO_REPORTS": "0"}


def _environment() -> dict[str, str]:
    """Of a worker: one thread, and a path on which it finds this package."""
    path = os.pathsep.join(filter(None, [FOLDER, os.environ.get("PYTHONPATH")]))
    return os.environ | ENVIRONMENT | {"PYTHONPATH": path}


class SubjectError(RuntimeError):
    """A subject's process ended; carries the last line that it wrote."""


@dataclass
class Outcome:
    """What was measured of a subject: processor times of its runs, s, and the largest memory, bytes.

    absence: why nothing was measured, empty if something was.
    """

    subject: Subject
    processor: list[float] = field(default_factory=list)
    peak: int = 0
    check: dict[str, Any] = field(default_factory=dict)
    absence: str = ""

    @property
    def median(self) -> float:
        """Median processor time of a run, s."""
        return statistics.median(self.processor)


class Worker:
    """The process of a subject. Raises SubjectError where it fails."""

    def __init__(self, subject: Subject) -> None:
        self._errors = tempfile.TemporaryFile("w+")  # noqa: SIM115 - lives as long as the process
        command = [sys.executable, "-m", "benchmarks.worker", subject.target, json.dumps(subject.arguments)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=_environment(),
        )
        try:
            self.prepared = self._answer()
        except SubjectError:
            self.close()
            raise

    def ask(self, command: str) -> dict[str, Any]:
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        line = self._process.stdout.readline()
        if not line:
            code = self._process.wait()
            self._errors.seek(0)
            said = [text.strip() for text in self._errors if text.strip()]
            raise SubjectError(said[-1] if said else f"exit code {code}")
        return json.loads(line)

    def close(self) -> None:
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()
        self._errors.close()


def measure(subjects: list[Subject], repeats: int, seconds: float) -> list[Outcome]:
    """Outcomes in the order of the subjects, after a first run that is not counted.

    A subject runs `repeats` times, or fewer (at least once) if together they would take more than `seconds`.
    """
    outcomes = [Outcome(subject) for subject in subjects]
    workers: dict[int, Worker] = {}
    try:
        for i, outcome in enumerate(outcomes):
            if not outcome.subject.is_installed:
                outcome.absence = f"not installed ({INSTALL})"
                continue
            try:
                workers[i] = Worker(outcome.subject)
                outcome.check = workers[i].ask("check")
                workers[i].ask("run")
            except SubjectError as error:
                outcome.absence = f"failed: {error}"
        waiting = [i for i in workers if not outcomes[i].absence]
        while waiting:
            waiting = [i for i in waiting if _run_once(workers[i], outcomes[i], repeats, seconds)]
    finally:
        for worker in workers.values():
            worker.close()
    return outcomes


def _run_once(worker: Worker, outcome: Outcome, repeats: int, seconds: float) -> bool:
    """Whether the subject is to run once more."""
    took = worker.ask("run")
    outcome.processor.append(took["processor_s"])
    outcome.peak = took["peak_bytes"]
    return len(outcome.processor) < repeats and sum(outcome.processor) + took["processor_s"] < seconds
