"""Problems in files: the published one with other variables, rows and objective, all by name, for people who do not program.

[objective]
of = "segment.cruise.power"                    # a number of the analysis: docs/own-problem.md
unit = "W"
scale = 1000.0                                 # a change that counts; maximize = true turns it round

[variables.battery_mass]
fixed = 900.0                                  # or lower, upper, initial

[constraints.stall_speed]
drop = true                                    # or lower, upper

[constraints.span]                             # a new one
of = "shape.wing.span"
unit = "m"
upper = 12.0
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import torch
from pydantic import AfterValidator, BaseModel, Field, ValidationError, model_validator
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.config.layout_checks import stations
from lpc_mdo.config.tables import Name, Table, printable
from lpc_mdo.files.faults import fault, shortened, telling
from lpc_mdo.files.read import read_toml
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable
from lpc_mdo.problems.reduced import reduced
from lpc_mdo.problems.rows import tip_clearances
from lpc_mdo.problems.variables import sensible_range

LONGEST_NAME = 80
LARGEST = 1e12  # of a limit and of a scale in SI units, and over one of the smallest scale: beyond, no solver tells a change from none
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST, strict=True)] | None
Scale = Annotated[float, Field(ge=1.0 / LARGEST, le=LARGEST, strict=True)]
Unit = Annotated[str, Field(min_length=1, max_length=20), AfterValidator(printable)]


class _Objective(Table):
    of: str = Field(min_length=1, max_length=200)
    unit: Unit = "1"
    scale: Scale
    maximize: bool = Field(False, strict=True)


class _Variable(Table):
    fixed: Number = None
    lower: Number = None
    upper: Number = None
    initial: Number = None
    reason: str = Field("", max_length=300)

    @model_validator(mode="after")
    def _is_one_of_both(self) -> "_Variable":
        ends = (self.lower, self.upper, self.initial)
        if (self.fixed is None) == (ends == (None, None, None)):
            raise ValueError(" is invalid: it must have fixed, or some of lower, upper and initial")
        return self


class _Constraint(Table):
    of: str = Field("", max_length=200)
    unit: Unit = "1"
    lower: Number = None
    upper: Number = None
    scale: Scale = 1.0
    drop: bool = Field(False, strict=True)


class _ProblemFile(Table):
    name: Name = "own"
    formulation: Literal["paper", "reduced"] = "paper"
    objective: _Objective | None = None
    variables: dict[str, _Variable] = Field({}, max_length=200)
    constraints: dict[str, _Constraint] = Field({}, max_length=200)


def problem_of(file: Path | str, vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The problem that a file describes, for one aircraft and mission; numbers in SI units.

    Raises ConfigurationError with one sentence a fault: file, key, value, rule.
    """
    content, _ = read_toml(Path(file))
    try:
        given = _ProblemFile.model_validate(content)
    except ValidationError as error:
        sentences = ["{}: {}{}.".format(file, *fault(_ProblemFile, e)) for e in telling(error.errors())[:5]]
        raise ConfigurationError("\n".join(sentences)) from None
    base = gross_weight_problem(vehicle, mission)
    with torch.no_grad():
        start = base.analyze(base.x0)
    try:
        problem = replace(
            base,
            name=given.name,
            settings={"problem": given.model_dump(exclude_defaults=True)},
            variables=_variables(base, given.variables, stations(vehicle)),
            constraints=_constraints(base, given, start, vehicle, mission),
            objective=base.objective if given.objective is None else _objective(given.objective, start),
        )
    except ValueError as error:
        raise ConfigurationError(f"{file}: {error}.") from None
    return reduced(problem) if given.formulation == "reduced" else problem


def _variables(
    base: Problem[Analysis], changes: dict[str, _Variable], stations: Mapping[str, tuple[float, float, str]]
) -> tuple[Variable, ...]:
    names = [variable.name for variable in base.variables]
    for name in changes:
        if name not in names:
            raise ValueError(f"variables.{name} is not a variable; it must be one of {', '.join(names)}")
    for variable in base.variables:
        if variable.name in changes:
            along = stations.get(variable.name)
            first, last = sensible_range(variable) if along is None else along[:2]
            _require_between(
                changes[variable.name], variable, first, last, "" if along is None else f", along {along[2]}"
            )
    return tuple(_changed(v, changes[v.name]) if v.name in changes else v for v in base.variables)


def _require_between(change: _Variable, variable: Variable, least: float, largest: float, what: str) -> None:
    for key in ("fixed", "lower", "upper", "initial"):
        value = getattr(change, key)
        if value is not None and not least <= value <= largest:
            raise ValueError(
                f"variables.{variable.name}.{key} = {value:g} {variable.unit} is invalid: it must lie between {least:.6g} and "
                f"{largest:.6g}{what}"
            )


def _changed(variable: Variable, change: _Variable) -> Variable:
    """One number for all elements of the block."""
    if change.fixed is not None:
        return replace(
            variable, lower=change.fixed, upper=change.fixed, initial=change.fixed, reason="fixed in the problem file"
        )
    kept: dict[str, Any] = {
        key: getattr(change, key) for key in ("lower", "upper", "initial") if getattr(change, key) is not None
    }
    reason = change.reason or ("bounds of the problem file" if {"lower", "upper"} & kept.keys() else variable.reason)
    for key, other in (("lower", variable.upper), ("upper", variable.lower)):  # a list beside a list
        if key in kept and not isinstance(other, float | int):
            kept[key] = (kept[key],) * len(other)
    changed = replace(variable, **kept, reason=reason)
    if bool((changed.lower_tensor > changed.upper_tensor).any()):
        raise ValueError(
            f"variables.{variable.name} is invalid: lower = {float(changed.lower_tensor.max()):g} must not exceed "
            f"upper = {float(changed.upper_tensor.min()):g}"
        )
    return changed


def _constraints(
    base: Problem[Analysis], given: _ProblemFile, start: Analysis, vehicle: Vehicle, mission: Mission
) -> tuple[Constraint[Analysis], ...]:
    rows = {row.name: row for row in base.constraints}
    if (radius := given.variables.get("rotor_radius")) is not None:  # disks that its new bound lets touch
        largest = max(v for v in (radius.fixed, radius.upper, vehicle.bounds.lift_rotor_radius.upper) if v is not None)
        for row in tip_clearances(vehicle, mission.requirements.rotor_tip_clearance, largest):
            rows.setdefault(row.name, row)
    for name, change in given.constraints.items():
        if not (name.isascii() and name.isidentifier() and len(name) <= LONGEST_NAME):
            raise ValueError(
                f"constraints.{shortened(name)} is invalid: its name must be a word of ASCII letters, digits and _, "
                f"{LONGEST_NAME} at most"
            )
        limits = {key: value for key in ("lower", "upper") if (value := getattr(change, key)) is not None}
        if name not in rows and not change.of:
            raise ValueError(f"constraints.{name}.of is missing: the problem has no row of that name to change")
        if change.drop and (change.of or limits):
            raise ValueError(f"constraints.{name}.drop = true is invalid beside of, lower or upper")
        if not change.drop and not limits:
            raise ValueError(f"constraints.{name} is invalid: it must have lower, upper or both, or drop = true")
        if change.drop:
            if name not in rows:
                raise ValueError(f"constraints.{name}.drop = true is invalid: there is no such row")
            del rows[name]
        elif change.of:
            number = quantity(change.of, start, f"constraints.{name}.of")
            row = Constraint(name, change.unit, number, scale=change.scale)
            rows[name] = replace(row, **limits)
        else:
            rows[name] = replace(rows[name], **limits)
        if name in rows and rows[name].lower > rows[name].upper:
            low, high = rows[name].lower, rows[name].upper
            raise ValueError(f"constraints.{name} is invalid: lower = {low:g} must not exceed upper = {high:g}")
    return tuple(rows.values())


def _objective(given: _Objective, start: Analysis) -> Objective[Analysis]:
    number = quantity(given.of, start, "objective.of")
    if number(start).dim() > 0:
        raise ValueError(f"objective.of = {given.of!r} is invalid: it must be one number, not {number(start).numel()}")
    if given.maximize:
        return Objective(f"minus {given.of}", given.unit, lambda a: -number(a), given.scale)
    return Objective(given.of, given.unit, number, given.scale)


def quantity(name: str, start: Analysis, key: str = "of") -> Callable[[Analysis], Tensor]:
    """A number of the analysis, or several, by name.

    "segment.NAME.VALUE" and "rotor.NAME.SEGMENT.VALUE" are the numbers of `Analysis.segment` and `Analysis.rotor`, "mass.GROUP" is a
    group's mass, "design.VARIABLE" a variable; all else is a path of attributes, e.g. "shape.wing.span". `start`: an analysis of
    the same problem, on which the name is tried. Raises ValueError with the names that there are.
    """
    head, *path = name.split(".")

    def value(a: Analysis) -> Any:
        if head == "segment" and len(path) == 2:
            return _attribute(a.segment(path[0]), path[1])
        if head == "rotor" and len(path) == 3:
            return _attribute(a.rotor(path[0], path[1]), path[2])
        if head == "mass" and len(path) == 1:
            return _entry(a.weights.groups, path[0])
        if head == "design" and len(path) == 1:
            return _entry(a.design.values(), path[0])
        found: Any = a
        for part in (head, *path):
            found = _entry(found, part) if isinstance(found, dict) else _attribute(found, part)
        return found

    try:
        tried = value(start)
    except (KeyError, ValueError) as error:
        raise ValueError(f"{key} = {name!r} is invalid: {error.args[0]}") from None
    if not isinstance(tried, Tensor) or not tried.is_floating_point() or not math.prod(tried.shape):
        raise ValueError(f"{key} = {name!r} is invalid: it must be a number of the analysis")
    return lambda a: _flat(value(a), a)


def _flat(value: Tensor, analysis: Analysis) -> Tensor:
    """(...,) or (..., k): the dimensions behind those of the designs as one."""
    batch = analysis.gross_mass.dim()
    return value.flatten(batch) if value.dim() > batch + 1 else value


def _attribute(node: Any, name: str) -> Any:
    """A field or property that the node's own classes declare; what pydantic and torch add is no part of an analysis."""
    own = [base for base in type(node).__mro__ if base not in (*BaseModel.__mro__, *Tensor.__mro__)]
    properties = {
        key for base in own for key, value in vars(base).items() if isinstance(value, property | cached_property)
    }
    fields = {key for key, value in getattr(node, "__dict__", {}).items() if not callable(value)}
    names = sorted(key for key in fields | properties if not key.startswith("_"))
    if not names:
        raise ValueError(f"{name!r} is not defined there")
    if name not in names:
        raise ValueError(f"{name!r} must be one of {', '.join(names)}")
    found = getattr(node, name)
    if found is None:
        raise ValueError(f"{name!r} is not defined there")
    return found


def _entry(node: dict[str, Any], name: str) -> Any:
    if name not in node:
        raise ValueError(f"{name!r} must be one of {', '.join(node)}")
    return node[name]
