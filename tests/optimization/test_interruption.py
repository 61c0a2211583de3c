"""Runs that are killed or stopped at any moment: nothing is lost but the step at work."""

import json
import multiprocessing
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
import torch

from lpc_mdo.optimization import Hooks, Options, minimize

TIGHT = Options(stationarity_tolerance=1e-8, feasibility_tolerance=1e-10)


def chain(hooks: Hooks | None = None, state: dict | None = None, pause: float = 0.0, options: Options = TIGHT):
    """Rosenbrock's function of six variables in a ball and above a plane; `pause` seconds an evaluation."""

    def objective(x):
        time.sleep(pause)
        return (100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1.0 - x[:-1]) ** 2).sum()

    return minimize(
        objective,
        torch.tensor([-1.2, 1.0, -0.5, 0.8, 1.5, -0.7], dtype=torch.float64),
        constraints=lambda x: torch.stack([x @ x, x.sum()]),
        constraint_lower=torch.tensor([-1.0, 2.0], dtype=torch.float64),
        constraint_upper=torch.tensor([2.0, 9.0], dtype=torch.float64),
        hooks=hooks,
        state=state,
        options=options,
    )


def _write(folder: Path) -> Hooks:
    def save(state: dict) -> None:
        fresh = folder / "checkpoint.new"
        fresh.write_text(json.dumps(state))
        fresh.replace(folder / "checkpoint.json")

    return Hooks(checkpoint=save)


def _work(folder: Path) -> None:
    file = folder / "checkpoint.json"
    state = json.loads(file.read_text()) if file.exists() else None
    chain(_write(folder), state, pause=1e-4)


def test_killed_at_ten_random_moments_a_run_resumes_to_the_same_bits(tmp_path):
    started = time.monotonic()
    whole = chain(pause=1e-4)
    duration = time.monotonic() - started
    assert whole.status == "converged"
    draw, fork = np.random.default_rng(7), multiprocessing.get_context("fork")
    for moment in draw.uniform(0.05, 0.95, 10):
        (folder := tmp_path / f"{moment:.6f}").mkdir()
        worker = fork.Process(target=_work, args=(folder,))
        worker.start()
        worker.join(moment * duration)
        worker.kill()
        worker.join()
        file = folder / "checkpoint.json"
        resumed = chain(state=json.loads(file.read_text()) if file.exists() else None)
        assert resumed.status == "converged"
        assert torch.equal(resumed.x, whole.x)
        assert torch.equal(resumed.multipliers, whole.multipliers)


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt, also where the parent process ignores it and its children with it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("phase", ["start", "restoration", "Newton", "augmented Lagrangian"])
def test_stopped_by_the_user_in_any_phase_a_run_returns_its_newest_point(phase, interruptible):
    options = Options(newton_iterations=0) if phase == "augmented Lagrangian" else TIGHT
    seen = []

    def stop(record):
        if record.phase == phase:
            seen.append(record)
            if len(seen) == (1 if phase in ("start", "restoration") else 2):
                os.kill(os.getpid(), signal.SIGINT)
                time.sleep(0.1)

    result = chain(Hooks(progress=stop), options=options)
    assert result.status == "interrupted"
    assert result.objective == pytest.approx(seen[-1].objective, rel=1e-12)
    assert result.certificate.feasibility == pytest.approx(seen[-1].violation, rel=1e-9, abs=1e-12)
    assert result.history[-1].phase == phase
