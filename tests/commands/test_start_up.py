"""What a command has to load before it can begin."""

import pkgutil
import subprocess
import sys

import pytest

from lpc_mdo import commands
from lpc_mdo.cli import main

HELP = """
import sys
from click.testing import CliRunner
from lpc_mdo.cli import main
assert CliRunner().invoke(main, {arguments}).exit_code == 0
"""
EVALUATION = """
import lpc_mdo, lpc_mdo.studies.runs, torch
problem = lpc_mdo.gross_weight_problem(*lpc_mdo.baseline())
x = problem.x0.clone().requires_grad_()
objective, rows = problem.evaluate(x)
torch.autograd.grad(objective + rows.sum(), x)
"""


def loaded(program: str, *names: str) -> list[str]:
    """Which of the packages `program` has loaded when it ends."""
    question = f"\nimport sys\nprint('loaded', *(name for name in {names!r} if name in sys.modules))"
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program + question], capture_output=True, text=True, check=True
    )
    return run.stdout.split("loaded")[-1].split()


@pytest.mark.parametrize("arguments", [["--help"], ["optimize", "--help"], ["--version"]])
def test_help_waits_for_no_numerical_package(arguments):
    assert not loaded(HELP.format(arguments=arguments), "torch", "numpy", "scipy", "pydantic", "matplotlib")


def test_an_optimization_waits_neither_for_symbolic_algebra_nor_for_figures():
    assert not loaded(EVALUATION, "sympy", "matplotlib", "torch._dynamo")


def test_every_command_is_the_file_of_its_name():
    found = {module.name for module in pkgutil.iter_modules(commands.__path__)}
    assert set(main.commands) == found - {"options", "study_run"}
