"""The whole model's derivatives against differences, from the 109 variables to objective and constraints."""

import torch

from lpc_mdo.config import load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.verification.comparison import Between, Comparison
from lpc_mdo.verification.self_check import GRADIENT_TOLERANCE, directional_derivatives


def comparisons() -> list[Comparison]:
    problem = gross_weight_problem(*load())
    seeded = torch.Generator().manual_seed(0)
    direction = 2.0 * torch.rand(1, problem.size, generator=seeded, dtype=torch.float64) - 1.0
    exact, differences = directional_derivatives(problem, direction)
    scale = 1.0 + differences.abs()
    return [
        Between("whole model", "central differences of fourth order").absolute(
            f"derivatives of the objective and {len(exact) - 1} constraints by all {problem.size} variables, one random "
            "direction, over one plus themselves",
            exact / scale, differences / scale, GRADIENT_TOLERANCE, "rounding and step", "of one",
        )
    ]  # fmt: skip
