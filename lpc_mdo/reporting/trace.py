"""evaluations.csv: objective and every row of the problem at each evaluation of a run, in engineering units."""

import csv
import io
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.files.write import write_atomically
from lpc_mdo.problems.problem import Constraint, Problem

FILE = "evaluations.csv"


class Trace:
    """Keeps what `Hooks.evaluation` tells, in the order of the calls; a resumed run keeps its own part."""

    def __init__(self, problem: Problem[Any]) -> None:
        self.problem = problem
        self.records: list[tuple[Tensor, Tensor]] = []

    def add(self, objective: Tensor, constraints: Tensor) -> None:
        """Scaled objective () and constraints (m,) of the problem."""
        self.records.append((objective.clone(), constraints.clone()))

    def text(self) -> str:
        """evaluations.csv so far."""
        problem = self.problem
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        objective = problem.objective
        writer.writerow(
            ["evaluation", f"{objective.name}_{objective.unit}", *(row.name for row in problem.constraints)]
        )
        for number, (value, constraints) in enumerate(self.records, start=1):
            parts = constraints.split(problem.row_sizes)
            rows = [
                f"{float(_tightest(row, part * row.scale)):.6g}"
                for row, part in zip(problem.constraints, parts, strict=True)
            ]
            writer.writerow([number, f"{float(value) * objective.scale:.6f}", *rows])
        return stream.getvalue()

    def write(self, folder: Path) -> None:
        write_atomically(folder / FILE, self.text())


def _tightest(row: Constraint[Any], values: Tensor) -> Tensor:
    """One figure () for a row of components (k,): the one nearest to or farthest beyond a limit; an equality's norm."""
    if row.kind == "equality":
        return torch.linalg.vector_norm(values - row.lower)
    room = torch.minimum(values - row.lower, row.upper - values)
    return values[room.argmin()]
