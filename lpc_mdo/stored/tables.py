"""history.csv and evaluations.csv: their columns follow from the result.json beside them."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lpc_mdo.files.read import ConfigurationError, read_csv_rows

HISTORY, EVALUATIONS = "history.csv", "evaluations.csv"
MOST_EVALUATIONS = 10**12


def objective_column(objective: dict[str, str]) -> str:
    return f"{objective['name']}_{objective['unit']}"


def read_history(file: Path, objective: dict[str, str]) -> list[dict[str, str]]:
    """Rows of a history.csv, one an iteration. Raises ConfigurationError where a figure could not draw one."""
    numbers = (objective_column(objective), "violation", "stationarity")
    return _checked(file, "evaluations", numbers)


def read_evaluations(file: Path, result: dict[str, Any]) -> list[dict[str, str]]:
    """Rows of the evaluations.csv of a validated result, one a design. Raises ConfigurationError as `read_history`."""
    numbers = (objective_column(result["objective"]), *(row["name"] for row in result["constraints"]))
    return _checked(file, "evaluation", numbers)


def _checked(file: Path, count: str, numbers: Sequence[str]) -> list[dict[str, str]]:
    rows = read_csv_rows(file, required=(count, *numbers))
    for number, row in enumerate(rows, start=1):
        if not (row[count].isascii() and row[count].isdigit() and int(row[count][:15]) <= MOST_EVALUATIONS):
            raise ConfigurationError(
                f"{file}: row {number}: {count} = {row[count][:40]!r} is invalid: it must be a whole number."
            )
        for column in numbers:
            if not _is_number(row[column]):
                raise ConfigurationError(
                    f"{file}: row {number}: {column} = {row[column][:40]!r} is invalid: it must be a number, or nan."
                )
    return rows


def _is_number(text: str) -> bool:
    try:
        value = float(text)
    except ValueError:
        return False
    return math.isnan(value) or abs(value) <= 1e30
