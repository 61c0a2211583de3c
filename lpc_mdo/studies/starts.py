"""Many starts scattered around the baseline design: how far the optimum depends on where the search begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.problems.choice import Case, chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.study import Axis, Parameter, Study

REACH = 0.1  # of every variable's range, to either side of the baseline
BATCH = 24  # starts evaluated at a time


@dataclass(frozen=True)
class Scatter:
    """The same problem from scattered starts; values are the starts' numbers.

    Start k is uniform within `reach` times the range between a variable's bounds, to either side of the baseline, clipped
    to the bounds, every variable alone. It depends on seed and k, not on how many starts there are.
    """

    vehicle: Vehicle
    mission: Mission
    case: Case
    is_reduced: bool  # the gross-weight problem in its reduced formulation
    seed: int
    reach: float

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        problem = self.problem
        return [_started(problem, self.start(int(value))) for value in values]

    @property
    def problem(self) -> Problem:
        """The problem with the baseline as its start."""
        return _problem(self.vehicle, self.mission, self.case, self.is_reduced)

    def start(self, number: int) -> Tensor:
        """Scaled x (n,) of a start."""
        problem = self.problem
        away = np.random.default_rng([self.seed, number]).uniform(-1.0, 1.0, problem.size)
        return torch.maximum(
            torch.minimum(problem.x0 + 2.0 * self.reach * torch.from_numpy(away), problem.upper), problem.lower
        )

    def violations(self, numbers: Sequence[int]) -> list[float]:
        """Largest violation of each start, every row over its scale in the problem; infinite where the model fails."""
        problem, found = self.problem, []
        starts = torch.stack([self.start(number) for number in numbers])
        for part in starts.split(BATCH):
            with torch.no_grad():
                _, rows = problem.evaluate(part)
            beyond = torch.maximum(problem.constraint_lower - rows, rows - problem.constraint_upper)
            found += beyond.max(-1).values.nan_to_num(nan=float("inf")).clamp(min=0.0).tolist()
        return found


_problem = lru_cache(maxsize=1)(chosen_problem)  # kept for the next start of the same problem


def _started(problem: Problem, x: Tensor) -> Problem:
    """The problem with x (n,) as its start."""
    values = problem.physical(x)
    # Rounding must not carry a start on a bound beyond it.
    variables = tuple(
        replace(v, initial=values[v.name].clamp(v.lower_tensor, v.upper_tensor).tolist()) for v in problem.variables
    )
    return replace(problem, variables=variables)


def no_slope(value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> None:
    """Starts are no parameter of the problem: nothing changes along them."""


def scattered_starts(
    vehicle: Vehicle,
    mission: Mission,
    case: Case,
    count: int,
    seed: int = 0,
    reach: float = REACH,
    is_reduced: bool = False,
) -> Study:
    """A study of `count` starts, numbered from 1. Raises ConfigurationError for values out of range."""
    if count < 2:
        raise ConfigurationError(f"--starts {count} is not allowed; it must be at least 2.")
    if not 0.0 < reach <= 1.0:
        raise ConfigurationError(f"--reach {reach:g} is not allowed; it must lie between 0 and 1.")
    problems = Scatter(vehicle, mission, case, is_reduced, seed, reach)
    problem = problems.problem
    objective = "sound_pressure_level_dba" if isinstance(case, tuple) else "gross_mass_kg"
    return Study(
        kind="starts",
        name="starts",
        problem=problem.name,
        formulation=problem.formulation,
        inputs=(vehicle, mission),
        method="scatter",
        parameter=Parameter("start", "1"),
        axes=(Axis("start", "1", None), Axis(objective, "dB(A)" if isinstance(case, tuple) else "kg", "minimize")),
        values=tuple(float(number) for number in range(1, count + 1)),
        problems=problems,
        slope=no_slope,
    )
