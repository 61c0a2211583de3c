"""The design and the multipliers of a stored result, as a problem takes them."""

import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.values import require_numbers
from lpc_mdo.problems.problem import Problem

ROUNDING = 1e-9  # of a variable's range, that stored digits may lose


def scaled_design(result: dict[str, Any], file: Path, problem: Problem) -> Tensor:
    """Scaled x (n,) of a validated result. Raises ConfigurationError where it is none of this problem."""
    values = _values(result, file, problem)
    if beyond := _beyond(values, problem):
        raise ConfigurationError(f"{file}: design variable {beyond[0]}.")
    return problem.scaled(values)


def start_design(result: dict[str, Any], file: Path, problem: Problem) -> Tensor:
    """As `scaled_design`, from a result of another problem: variables beyond their bounds start on them, with a warning."""
    values = _values(result, file, problem)
    if beyond := _beyond(values, problem):
        more = f", and so do {len(beyond) - 1} more" if len(beyond) > 1 else ""
        warnings.warn(f"{file}: design variable {beyond[0]}: the start takes the bound{more}", stacklevel=2)
    return problem.scaled(values)


def _values(result: dict[str, Any], file: Path, problem: Problem) -> dict[str, Any]:
    values = {entry["name"]: entry["value"] for entry in result["design_variables"]}
    for variable in problem.variables:
        if variable.name not in values:
            raise ConfigurationError(f"{file}: design variable {variable.name} is missing.")
        try:
            require_numbers(values[variable.name], variable.size)
        except ValueError:
            shape = " x ".join(str(size) for size in variable.size) or "1"
            raise ConfigurationError(
                f"{file}: design variable {variable.name} must hold {shape} finite numbers."
            ) from None
    return values


def _beyond(values: dict[str, Any], problem: Problem) -> list[str]:
    """The scalars that lie beyond their bounds, in words."""
    found, first = [], 0
    for variable in problem.variables:
        value = torch.as_tensor(values[variable.name], dtype=torch.float64).flatten()
        lower, upper = variable.lower_tensor.flatten(), variable.upper_tensor.flatten()
        room = ROUNDING * (1.0 + (upper - lower).abs() + value.abs())
        for i in torch.nonzero((value < lower - room) | (value > upper + room)).flatten().tolist():
            found.append(
                f"{problem.variable_label(first + i)} = {float(value[i]):g} {variable.unit} lies beyond its bounds, "
                f"{float(lower[i]):g} and {float(upper[i]):g}"
            )
        first += variable.count
    return found


def multipliers_by_row(result: dict[str, Any], file: Path, problem: Problem) -> dict[str, Any]:
    """Multipliers in engineering units by row. Raises ConfigurationError where rows are none of this problem's."""
    rows = {row["name"]: row for row in result["constraints"]}
    for row, size in zip(problem.constraints, problem.row_sizes, strict=True):
        if row.name not in rows:
            raise ConfigurationError(f"{file}: constraint {row.name} is missing.")
        if rows[row.name]["size"] != size:
            raise ConfigurationError(
                f"{file}: constraint {row.name} has {rows[row.name]['size']} components; the problem's has {size}."
            )
    return {name: row["multiplier"] for name, row in rows.items()}
