"""The whole model: objective and constraints of the gross-weight problem, and their gradient."""

from typing import Any

import torch
from torch import Tensor

import lpc_mdo
from benchmarks.refinement import refined
from benchmarks.subject import Task
from lpc_mdo.problems.problem import Problem


def prepare(designs: int = 0, has_gradient: bool = True, twist_points: int = 4, chord_points: int = 2) -> Task:
    """`designs` in one batch, 0 for one without a leading dimension; control points of every blade's twist and chord."""
    vehicle, mission = lpc_mdo.baseline()
    problem = lpc_mdo.gross_weight_problem(refined(vehicle, twist_points, chord_points), mission)
    x0 = problem.x0.repeat(designs, 1) if designs else problem.x0

    def run() -> Tensor:
        return gradient(problem, x0) if has_gradient else value(problem, x0)

    def check() -> dict[str, Any]:
        """Results that the blades shape, of the first design."""
        with torch.no_grad():
            found = problem.analyze(x0.reshape(-1, problem.size)[:1])
        charge = found.energy.battery.final_state_of_charge
        return {"variables": problem.size, "results": [found.observed_dba[0, 0].item(), charge[0].item()]}

    return Task(run, check)


def value(problem: Problem, x: Tensor) -> Tensor:
    """Objective (...,) without a graph."""
    with torch.no_grad():
        return problem.evaluate(x)[0]


def gradient(problem: Problem, x: Tensor) -> Tensor:
    """Gradient (..., n) of the sum of objective and constraints of every design: one backward pass."""
    leaf = x.clone().requires_grad_()
    objective, rows = problem.evaluate(leaf)
    (found,) = torch.autograd.grad(objective.sum() + rows.sum(), leaf)
    return found
