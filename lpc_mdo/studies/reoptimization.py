"""Sensitivities held against what they foretell: the optimum found anew with one number a per cent lower and higher."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import torch
from torch import Tensor

from lpc_mdo.model.analysis import Analysis
from lpc_mdo.optimization import Options
from lpc_mdo.optimization.result import Status
from lpc_mdo.problems.choice import chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.sensitivities import parameters, scaled, scaled_analyzer
from lpc_mdo.studies.single import minimum
from lpc_mdo.studies.sweep import lagrangian, with_limit

Change = Callable[[float], Problem]
"""A factor on one number of the problem, to the problem with it."""

SHARE = 0.01  # of the number, to either side
ENVELOPE_STEP = 1e-4  # relative, of the central difference of the Lagrangian
PRESSING = 1e-6  # scaled multiplier above which a row counts as active
ON_BOUND = 1e-9  # of half a variable's range
CHECKED = (
    "battery specific energy",
    "hover duration",
    "fixed masses and payload",
    "cruise speed",
    "hub, rotor and gear drag areas",
    "drag area beside wing and tail",
    "profile drag of the blades",
    "structural mass factor",
    "limit of sound pressure level",
    "limit of final state of charge",
)
"""What is optimized again by default, as far as the problem has it: of the two drag areas the vehicle uses one."""


@dataclass(frozen=True)
class Reoptimum:
    """The optimum with the changed number: objective in its unit, and what presses there."""

    status: Status
    objective: float
    active: frozenset[str]


@dataclass(frozen=True)
class Checked:
    """One number's effect on the optimal objective, in its unit for one per cent more."""

    label: str
    envelope: float  # the Lagrangian's partial derivative at the optimum
    objective: float  # at the optimum
    below: Reoptimum  # SHARE less
    above: Reoptimum  # SHARE more
    active: frozenset[str]  # what presses at the optimum

    @property
    def is_certified(self) -> bool:
        return self.below.status == self.above.status == "converged"

    @property
    def reoptimized(self) -> float:
        """Central difference of the optima."""
        return (self.above.objective - self.below.objective) / (2.0 * 100.0 * SHARE)

    @property
    def one_sided(self) -> tuple[float, float]:
        """Differences from the optimum downward and upward: apart by the curvature, or by a bend."""
        return (
            (self.objective - self.below.objective) / (100.0 * SHARE),
            (self.above.objective - self.objective) / (100.0 * SHARE),
        )

    @property
    def relative_difference(self) -> float | None:
        """Of the envelope's answer from the central difference; None where both are zero to the solver's resolution."""
        size = max(abs(self.envelope), abs(self.reoptimized))
        return None if size <= RESOLUTION * abs(self.objective) else (self.envelope - self.reoptimized) / size

    @property
    def changes(self) -> tuple[str, ...]:
        """What presses at one end only, in words."""
        words = []
        for end, sign in ((self.below, "-"), (self.above, "+")):
            words += [f"{name} presses at {sign}{SHARE:.0%}" for name in sorted(end.active - self.active)]
            words += [f"{name} no longer at {sign}{SHARE:.0%}" for name in sorted(self.active - end.active)]
        return tuple(words)


RESOLUTION = 1e-8  # of the objective: what a certified optimum does not resolve


def check(
    problem: Problem, x: Tensor, multipliers: Tensor, changes: Mapping[str, Change], options: Options | None = None
) -> Iterator[Checked]:
    """Optimize again for every change, starting from the optimum x (n,) with its multipliers (m,).

    x is scaled: bounds that move with the number carry the design along, in the envelope's answer too.
    """
    with torch.no_grad():
        objective = float(problem.evaluate(x)[0]) * problem.objective.scale
    active = _active(problem, x, multipliers)
    for label, change in changes.items():
        steps = (1.0 - ENVELOPE_STEP, 1.0 + ENVELOPE_STEP)
        low, high = (lagrangian(change(factor), x, multipliers) for factor in steps)
        envelope = (high - low) / (2.0 * ENVELOPE_STEP) * problem.objective.scale * 0.01
        below, above = (_reoptimum(change(factor), x, multipliers, options) for factor in (1.0 - SHARE, 1.0 + SHARE))
        yield Checked(label, envelope, objective, below, above, active)


def _reoptimum(problem: Problem, x: Tensor, multipliers: Tensor, options: Options | None) -> Reoptimum:
    result = minimum(problem, x, options=options, multipliers=multipliers)
    active = _active(problem, result.x, result.multipliers)
    return Reoptimum(result.status, result.objective * problem.objective.scale, active)


def _active(problem: Problem, x: Tensor, multipliers: Tensor) -> frozenset[str]:
    """Names of pressing inequality rows, and of variables on a bound."""
    is_inequality = problem.constraint_lower < problem.constraint_upper
    rows = torch.nonzero(is_inequality & (multipliers.abs() > PRESSING)).flatten().tolist()
    low = torch.nonzero(x <= -1.0 + ON_BOUND).flatten().tolist()
    high = torch.nonzero(x >= 1.0 - ON_BOUND).flatten().tolist()
    return frozenset(
        [problem.constraint_label(row) for row in rows]
        + [f"least {problem.variable_label(index)}" for index in low]
        + [f"largest {problem.variable_label(index)}" for index in high]
    )


def gross_weight_changes(problem: Problem[Analysis]) -> dict[str, Change]:
    """Everything that may be changed in the gross-weight problem: entries of PARAMETERS that it has, and finite limits but zero.

    Vehicle and mission make a new problem, so that limits and bounds move with them where they depend on them.
    """
    found: dict[str, Change] = {
        label: partial(_with_parameter, problem, file, path) for file, path, label in parameters(problem)
    }
    for row in problem.constraints:
        limit = row.lower if row.lower > -torch.inf else row.upper
        if row.kind == "inequality" and limit != 0.0:
            found[f"limit of {row.name.replace('_', ' ')}"] = partial(_with_limit, problem, row.name, limit)
    return found


def _with_parameter(problem: Problem[Analysis], file: str, path: tuple[str, ...], factor: float) -> Problem[Analysis]:
    analyzer = problem.analyze_design
    if file == "airfoil":
        return replace(problem, analyze_design=scaled_analyzer(analyzer, file, path, factor))
    vehicle, mission = analyzer.vehicle, analyzer.mission
    if file == "vehicle":
        vehicle = scaled(vehicle, path, factor)
    else:
        mission = scaled(mission, path, factor)
    return chosen_problem(vehicle, mission, case=None, is_reduced=problem.formulation == "reduced")


def _with_limit(problem: Problem[Analysis], row: str, limit: float, factor: float) -> Problem[Analysis]:
    return with_limit(problem, row, factor * limit)
