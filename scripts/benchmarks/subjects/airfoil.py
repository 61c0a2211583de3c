"""Errors and speed of the airfoil surrogate and of NeuralFoil on the same unseen polars."""

from dataclasses import asdict
from typing import Any

import torch

from benchmarks.subject import Task
from lpc_mdo.airfoils.shape import airfoil_shape
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.training.airfoil_command import SHIPPED
from lpc_mdo.training.neuralfoil import BATCH, compare
from lpc_mdo.training.polar_data import read

SEED = 0  # of the shipped surrogate's training, which left the same polars unseen


def prepare_comparison() -> Task:
    """check: {"figures": {points: {model: errors}}, "speed": {model: evaluations per second}}."""
    data = read(SHIPPED / "naca4412.csv.gz")

    def check() -> dict[str, Any]:
        return asdict(compare(load_airfoil("naca4412"), airfoil_shape("4412"), data, SEED))

    return Task(lambda: None, check)


def prepare_own(has_gradient: bool) -> Task:
    """The surrogate alone, at as many points as the comparison uses at once."""
    polar = load_airfoil("naca4412")
    alpha = torch.linspace(-0.1, 0.2, BATCH, dtype=torch.float64, requires_grad=has_gradient)
    reynolds, mach = torch.full_like(alpha, 1e6), torch.full_like(alpha, 0.2)

    def run() -> object:
        lift, drag = polar(alpha, reynolds, mach)
        return torch.autograd.grad(lift.sum() + drag.sum(), alpha) if has_gradient else lift

    return Task(run)
