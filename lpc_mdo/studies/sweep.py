"""Sweeps: the optimum against any scalar of the vehicle or mission file, or against the limit of any constraint."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle, load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.study import Axis, Parameter, Study

RELATIVE_STEP = 1e-4  # of the parameter, for the envelope theorem's partial derivative
UNITS = {  # endings of file keys, the longest first
    "_Wh_per_kg": "Wh/kg",
    "_m_per_s": "m/s",
    "_dba": "dB(A)",
    "_deg": "deg",
    "_rpm": "rpm",
    "_m2": "m^2",
    "_kg": "kg",
    "_m": "m",
    "_s": "s",
    "_K": "K",
    "_V": "V",
}
NAMED = {  # what it is in the files or in the problem, and values around the baseline
    "battery-energy-density": (
        "vehicle.battery.specific_energy_Wh_per_kg",
        (340.0, 360.0, 380.0, 400.0, 420.0, 440.0),
    ),
    "final-state-of-charge": ("final_state_of_charge", (0.1, 0.15, 0.2, 0.25)),
}


@dataclass(frozen=True)
class ByKey:
    """The gross-weight problem for each value of a file key, from files read beforehand."""

    table: tuple[tuple[float, Vehicle, Mission], ...]

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        inputs = {value: (vehicle, mission) for value, vehicle, mission in self.table}
        return [gross_weight_problem(*inputs[value]) for value in values]

    def near(self, value: float) -> tuple[float, float]:
        """The values of the table a step below and above, or itself where the file's range ends."""
        known = {entry[0] for entry in self.table}
        below, above = (end if end in known else value for end in _around(value))
        return below, above


@dataclass(frozen=True)
class ByLimit:
    """The gross-weight problem for each limit of one constraint; all share one analysis."""

    vehicle: Vehicle
    mission: Mission
    constraint: str

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        problem = gross_weight_problem(self.vehicle, self.mission)
        return [with_limit(problem, self.constraint, value) for value in values]


@dataclass(frozen=True)
class Envelope:
    """d optimum / d parameter by the envelope theorem: the Lagrangian's partial derivative at the optimum.

    x is scaled to bounds of -1 and 1, which therefore do not move with the parameter: bounds that do are included.
    The partial derivative is a central difference of two evaluations, exact for limits.
    """

    problems: Callable[[Sequence[float]], list[Problem]]

    def __call__(self, value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> float:
        near = getattr(self.problems, "near", _around)
        ends = near(value)
        below, above = (lagrangian(p, x, multipliers) for p in self.problems(ends))
        return (above - below) / (ends[1] - ends[0]) * problem.objective.scale


def _around(value: float) -> tuple[float, float]:
    step = RELATIVE_STEP * abs(value) or RELATIVE_STEP
    return value - step, value + step


def lagrangian(problem: Problem, x: Tensor, multipliers: Tensor) -> float:
    """Scaled f + multipliers . (c - limit), each row with the limit on which its multiplier presses."""
    with torch.no_grad():
        objective, values = problem.evaluate(x)
    limit = torch.where(multipliers > 0.0, problem.constraint_upper, problem.constraint_lower)
    gap = torch.where(multipliers == 0.0, 0.0, values - limit)
    return float(objective + (multipliers * gap).sum())


def with_limit(problem: Problem, name: str, limit: float) -> Problem:
    """The same problem with another limit of one inequality row.

    Raises ConfigurationError if there is no such row, or if it is an equality or has two limits.
    """
    rows = {constraint.name: constraint for constraint in problem.constraints}
    inequalities = [row.name for row in problem.constraints if row.kind == "inequality"]
    if name not in inequalities:
        raise ConfigurationError(f"{name!r} is not allowed; it must be one of {', '.join(inequalities)}.")
    row = rows[name]
    if math.isfinite(row.lower) and math.isfinite(row.upper):
        raise ConfigurationError(f"{name!r} is not allowed; it has a lower and an upper limit.")
    changed = replace(row, lower=limit) if math.isfinite(row.lower) else replace(row, upper=limit)
    return replace(problem, constraints=tuple(changed if c.name == name else c for c in problem.constraints))


def ordered(values: Sequence[float]) -> tuple[float, ...]:
    """Values in increasing order. Raises ConfigurationError unless they are two or more different finite numbers."""
    if len(values) < 2 or len(set(values)) != len(values) or not all(math.isfinite(value) for value in values):
        text = ",".join(f"{value:g}" for value in values)
        raise ConfigurationError(f"--values {text} is not allowed; it must be two or more different finite numbers.")
    return tuple(sorted(values))


def by_key(
    vehicle: Path | None, mission: Path | None, overrides: Sequence[str], key: str, values: Sequence[float]
) -> ByKey:
    """Reads the files once a value, so that a value out of range is told before anything runs."""

    def read(value: float) -> tuple[float, Vehicle, Mission]:
        return value, *load(vehicle, mission, (*overrides, f"{key}={value!r}"))

    table = [read(value) for value in values]
    for end in (end for value in values for end in _around(value)):
        try:
            table.append(read(end))
        except ConfigurationError:  # beyond the end of the range: the difference is one-sided there
            continue
    return ByKey(tuple(table))


def sweep(
    name: str,
    vehicle: Path | None = None,
    mission: Path | None = None,
    overrides: Sequence[str] = (),
    values: Sequence[float] = (),
) -> Study:
    """A sweep by its name: one of NAMED, a file key as in --set (vehicle.wing.area_m2), or a constraint's name.

    Raises ConfigurationError for an unknown name or values that the file or the problem does not allow.
    """
    key, usual = NAMED.get(name, (name, ()))
    if not values and not usual:
        raise ConfigurationError(f"sweep {name}: --values is missing, e.g. --values 1,2,3.")
    chosen, files = ordered(values or usual), load(vehicle, mission, overrides)
    if key.startswith(("vehicle.", "mission.")):
        problems: ByKey | ByLimit = by_key(vehicle, mission, overrides, key, chosen)
        unit = next((unit for ending, unit in UNITS.items() if key.endswith(ending)), "1")
    else:
        problems = ByLimit(*files, key)
        unit = next(c.unit for c in problems(chosen[:1])[0].constraints if c.name == key)
    return Study(
        kind="sweep",
        name=name,
        problem="gross-weight",
        formulation="paper",
        inputs=files,
        method="parameter",
        parameter=Parameter(key.rsplit(".", 1)[-1], unit, key),
        axes=(Axis(key.rsplit(".", 1)[-1], unit, None), Axis("gross_mass_kg", "kg", "minimize")),
        values=chosen,
        problems=problems,
        slope=Envelope(problems),
    )
