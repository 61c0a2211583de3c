"""Whole runs: the optimum of the main problem, a run killed half-way, and the peers' opinion of the optimum."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from conftest import REFERENCE

from lpc_mdo.optimization import Hooks, Options, minimize_problem

STORED = json.loads((REFERENCE / "optimum.json").read_text())
COMMAND = [sys.executable, "-c", "from lpc_mdo.cli import main; main()", "optimize", "--quiet", "--output"]
GIVE_UP = 600.0  # s, for a checkpoint to appear: far beyond what it takes


def kill_after_iterations(folder: Path, count: int) -> None:
    """Start a run and kill it with SIGKILL once its checkpoint shows `count` iterations."""
    process = subprocess.Popen([*COMMAND, str(folder)])
    started = time.monotonic()
    try:
        while time.monotonic() - started < GIVE_UP and process.poll() is None:
            file = folder / "checkpoint.json"
            if file.exists() and json.loads(file.read_text())["records"] >= count:
                break
            time.sleep(0.2)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert process.returncode == -signal.SIGKILL, "the run ended before it was killed"


def test_a_killed_run_resumes_to_the_certified_optimum(tmp_path):
    kill_after_iterations(tmp_path, 8)  # two Newton steps after the six that lead to a nearly feasible design
    assert not (tmp_path / "result.json").exists()
    assert subprocess.run([*COMMAND, str(tmp_path), "--resume"], check=False).returncode == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["status"] == "converged"
    assert (result["n_design_variables"], result["n_constraints"]) == (109, 17)
    assert result["certificate"]["stationarity"] <= 1e-4
    assert result["certificate"]["feasibility"] <= 1e-6
    # The stored optimum is of another machine; a certificate of 1e-4 leaves about 0.01 % of play.
    assert result["outputs"]["gross_mass_kg"] == pytest.approx(STORED["objective_kg"], rel=1e-4)
    history = (tmp_path / "history.csv").read_text().splitlines()
    assert len(history) > 3


def test_slsqp_finds_nothing_better_near_the_optimum(problem):
    """A run of 20 iterations from our optimum lowers the gross mass by less than 0.05 %."""
    feasible = []

    def keep(progress):
        if progress.violation <= 1e-5:
            feasible.append(progress.objective)

    minimize_problem(
        problem.evaluate,
        problem.scaled(STORED["design"]),
        problem.lower,
        problem.upper,
        problem.constraint_lower,
        problem.constraint_upper,
        solver="slsqp",
        options=Options(outer_iterations=2),
        hooks=Hooks(progress=keep),
    )
    start = float(problem.evaluate(problem.scaled(STORED["design"]))[0])
    assert feasible, "no feasible iterate"
    assert min(feasible) > (1.0 - 5e-4) * start
    assert torch.isfinite(torch.tensor(feasible)).all()
