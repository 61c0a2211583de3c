"""The design and the multipliers of a stored result, as a problem takes them."""

from pathlib import Path
from typing import Any

from torch import Tensor

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.problems.problem import Problem
from lpc_mdo.stored.values import require_numbers


def scaled_design(result: dict[str, Any], file: Path, problem: Problem) -> Tensor:
    """Scaled x (n,) of a validated result. Raises ConfigurationError where it is none of this problem."""
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
    return problem.scaled(values)


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
