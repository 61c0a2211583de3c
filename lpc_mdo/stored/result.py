"""result.json, schema lpc-mdo/result/1."""

import math
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from lpc_mdo.files.values import (
    Count,
    Name,
    NotNegative,
    Number,
    Positive,
    Stored,
    Text,
    read_table,
    require_numbers,
    shape_of,
    validated,
)
from lpc_mdo.stored.diagnosis import Diagnosis, OnBound
from lpc_mdo.stored.outputs import OUTPUTS, Outputs
from lpc_mdo.stored.provenance import Provenance, Settings

SCHEMA = "lpc-mdo/result/1"
FILE = "result.json"
ON_BOUND = 1e-6  # rounding beyond a bound


class Objective(Stored):
    name: Name
    unit: Name
    initial: Number
    value: Number


class DesignVariable(Stored):
    """`value` and `initial` are numbers in nested lists of one shape, `size` of them.

    `lower` and `upper` are one number for all, or one for each element of the first dimension.
    """

    name: Name
    size: Count = Field(ge=1)
    unit: Name
    lower: Any
    upper: Any
    initial: Any
    value: Any

    @model_validator(mode="after")
    def _has_numbers(self) -> "DesignVariable":
        if shape_of(self.initial) != shape_of(self.value):
            raise ValueError("initial has another shape than value; both must have the same")
        bounds = self._bounds()
        for key in ("initial", "value"):
            value = getattr(self, key)
            shape = shape_of(value)
            if len(shape) > 3:
                raise ValueError(f"{key} nests too deeply; it must hold {self.size} numbers")
            count = math.prod(shape)
            if count != self.size:
                raise ValueError(f"{key} holds {count} numbers; it must hold size = {self.size}")
            parts = zip(value, bounds, strict=True) if len(bounds) > 1 else [(value, bounds[0])]
            for part, (lower, upper) in parts:
                room = ON_BOUND * (1.0 + upper - lower)
                try:
                    require_numbers(part, shape_of(part), lower - room, upper + room)
                except ValueError as error:
                    raise ValueError(f"{key}{error}") from None
        return self

    def _bounds(self) -> list[tuple[float, float]]:
        """Lower and upper bound of all, or of every element of the first dimension."""
        ends = {}
        for key in ("lower", "upper"):
            end, rows = getattr(self, key), shape_of(self.value)[:1]
            try:
                ends[key] = require_numbers(end, rows if isinstance(end, list) else ())
            except ValueError as error:
                raise ValueError(f"{key}{error}") from None
        if isinstance(self.lower, list) != isinstance(self.upper, list):
            raise ValueError("upper is invalid: it must be a list if lower is one, and only then")
        is_list = isinstance(self.lower, list)
        bounds = list(zip(ends["lower"], ends["upper"], strict=True)) if is_list else [(self.lower, self.upper)]
        for lower, upper in bounds:
            if upper < lower:
                raise ValueError(f"upper = {upper:g} is invalid: it must be at least lower = {lower:g}")
        return bounds


class Constraint(Stored):
    """A row of several components has lists of `size` numbers, null where one was not finite."""

    name: Name
    size: Count = Field(ge=1)
    unit: Name
    kind: Literal["equality", "inequality"]
    lower: Number | None
    upper: Number | None
    initial: Any
    value: Any
    multiplier: Any
    active: bool = Field(strict=True)
    norm: Number | None = None  # of an equality of several components

    @model_validator(mode="after")
    def _has_numbers(self) -> "Constraint":
        shape = () if self.size == 1 else (self.size,)
        for key in ("initial", "value", "multiplier"):
            try:
                require_numbers(getattr(self, key), shape, has_gaps=key != "multiplier")
            except ValueError as error:
                raise ValueError(f"{key}{error}") from None
        if self.kind == "equality" and (self.lower is None or self.lower != self.upper):
            raise ValueError("kind = 'equality' is invalid: lower and upper must be one number")
        if self.kind == "inequality" and self.lower is None and self.upper is None:
            raise ValueError("lower is invalid: an inequality must have a lower or an upper limit")
        return self


class Tolerance(Stored):
    stationarity: Positive
    feasibility: Positive


class Certificate(Stored):
    stationarity: NotNegative | None
    feasibility: NotNegative | None
    complementarity: NotNegative | None
    tolerance: Tolerance


class Counts(Stored):
    outer: Count
    inner: Count = 0  # results of earlier versions have none
    evaluations: Count
    gradients: Count


class Timing(Stored):
    setup_s: NotNegative
    optimize_s: NotNegative
    total_s: NotNegative
    report_s: NotNegative


class StoredFlag(Stored):
    """Where the design leaves a model's regime."""

    what: Name
    where: Text
    value: Number | None
    limit: Number | None
    message: Text


class LimitSensitivity(Stored):
    """Of the objective to the limit of an active row of one component."""

    of: Name
    with_respect_to: Name
    value: Number | None
    unit: Text


class Result(Stored):
    """What `lpc_mdo.optimize` returns and result.json holds: initial and final design, rows, certificate, outputs.

    Values are in the units beside them; what was not finite is None. Read from a file, everything is checked.
    """

    format: Literal["lpc-mdo/result/1"] = Field("lpc-mdo/result/1", alias="schema")
    vehicle: Name | None = None  # results of earlier versions name none
    is_published_case: bool = Field(False, strict=True)
    problem: Name
    formulation: Name
    settings: Settings = Field(default_factory=dict)
    status: Name
    message: Text
    objective: Objective
    design_variables: tuple[DesignVariable, ...] = Field(min_length=1)
    n_design_variables: Count
    variables_on_bounds: tuple[OnBound, ...]
    constraints: tuple[Constraint, ...]
    n_constraints: Count
    certificate: Certificate
    diagnosis: Diagnosis | None = None
    counts: Counts
    timing: Timing
    outputs: dict[str, Any]
    flags: tuple[StoredFlag, ...] = ()
    sensitivities: tuple[LimitSensitivity, ...] = ()
    provenance: Provenance

    @property
    def is_converged(self) -> bool:
        return self.status == "converged"

    @property
    def design(self) -> dict[str, Any]:
        """Numbers, or nested lists of them, of the final design by the variables' names, in their units."""
        return {variable.name: variable.value for variable in self.design_variables}

    def constraint(self, name: str) -> Constraint:
        """The row of that name. Raises KeyError where there is none."""
        return {row.name: row for row in self.constraints}[name]

    def content(self) -> dict[str, Any]:
        """As result.json holds it."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True, warnings=False)

    @model_validator(mode="after")
    def _is_of_one_piece(self) -> "Result":
        for key in ("design_variables", "constraints"):
            names = [entry.name for entry in getattr(self, key)]
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise ValueError(f"{key} holds {twice!r} twice; every name must stand once")
        total = sum(variable.size for variable in self.design_variables)
        if self.n_design_variables != total:
            raise ValueError(
                f"n_design_variables = {self.n_design_variables} is invalid: design_variables holds {total}"
            )
        if self.n_constraints != len(self.constraints):
            raise ValueError(
                f"n_constraints = {self.n_constraints} is invalid: constraints holds {len(self.constraints)}"
            )
        if self.problem == "gross-weight":
            self._require("constraints", "sound_pressure_level", "final_state_of_charge")
            self._require("design_variables", "battery_mass")
            noise = next(row for row in self.constraints if row.name == "sound_pressure_level")
            if noise.upper is None:
                raise ValueError("constraints: sound_pressure_level must have an upper limit")
        return self

    def _require(self, key: str, *names: str) -> None:
        present = {entry.name for entry in getattr(self, key)}
        for name in names:
            if name not in present:
                raise ValueError(f"{key}: {name} is missing")


def read_result(file: Path) -> dict[str, Any]:
    """Content of a result.json. Raises ConfigurationError where any of it is not as the format says."""
    content = read_table(file, SCHEMA)
    result = validated(Result, content, file)
    validated(OUTPUTS.get(result.problem, Outputs), content["outputs"], file, "outputs")
    return content


def design_of(result: dict[str, Any]) -> dict[str, Any]:
    """Variables of a result in SI units, by name."""
    return {variable["name"]: variable["value"] for variable in result["design_variables"]}
