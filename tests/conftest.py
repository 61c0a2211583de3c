"""Shared helpers: reference figures of other codes, and one problem and one whole run for all tests."""

import fcntl
import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from click.testing import CliRunner
from torch import Tensor

from lpc_mdo.cli import main
from lpc_mdo.config import load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem

REFERENCE = Path(__file__).parent / "reference"
FAULTS = Path(__file__).parent / "faults"  # small inputs that once went wrong
torch.set_num_threads(1)
# What a parent ignores it hands down, Ctrl-C to a shell's background job, a hang-up under nohup; the tests of interruption need all
# of them heard.
signal.signal(signal.SIGINT, signal.default_int_handler)
for _unheard in (signal.SIGHUP, signal.SIGTERM):
    signal.signal(_unheard, signal.SIG_DFL)


@pytest.fixture(scope="session")
def reference() -> Callable[[str], dict[str, Any]]:
    return lambda name: json.loads((REFERENCE / f"{name}.json").read_text())


@pytest.fixture(scope="session")
def problem() -> Problem:
    return gross_weight_problem(*load())


@pytest.fixture(scope="session")
def baseline_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `lpc-mdo optimize` leaves, made once for all processes of a test run: to be read or copied, not changed."""
    own = tmp_path_factory.getbasetemp()
    home = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "baseline_run"
    home.mkdir(exist_ok=True)
    with (home / "lock").open("w") as lock, pytest.MonkeyPatch.context() as patch:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (home / "done").exists():
            patch.chdir(home)
            done = CliRunner().invoke(main, ["optimize"])
            assert done.exit_code == 0, done.output
            (home / "done").touch()
    return home / "runs" / "baseline"


def number(value: float) -> Tensor:
    return torch.tensor(value, dtype=torch.float64)


def central_difference(function: Callable[[Tensor], Tensor], x: Tensor, step: float) -> Tensor:
    """Fourth-order central differences: (outputs, inputs)."""
    columns = []
    for i in range(x.numel()):
        e = torch.zeros_like(x)
        e.view(-1)[i] = step
        f = [function(x + k * e).detach() for k in (2, 1, -1, -2)]
        columns.append((-f[0] + 8 * f[1] - 8 * f[2] + f[3]) / (12 * step))
    return torch.stack(columns, dim=-1)
