"""The iterations of a run in the terminal."""

import math

from rich.box import SIMPLE
from rich.console import Console
from rich.live import Live
from rich.table import Table

from lpc_mdo.optimization import Progress
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.tables import POUNDS_PER_KILOGRAM

SHOWN_ROWS = 12


class RunDisplay:
    """A live table in a terminal, plain lines elsewhere; `is_verbose` adds inner iterations, steps and active sets."""

    def __init__(self, console: Console, problem: Problem, is_verbose: bool) -> None:
        self.console, self.problem, self.is_verbose = console, problem, is_verbose
        self.records: list[Progress] = []
        self.live = Live(console=console, refresh_per_second=4) if console.is_terminal else None

    def __enter__(self) -> "RunDisplay":
        if self.live:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            self.live.stop()

    def add(self, record: Progress) -> None:
        self.records.append(record)
        if self.live:
            self.live.update(self._table())
        else:
            self.console.print("  ".join(self._cells(record)), soft_wrap=True, highlight=False)

    def _cells(self, record: Progress) -> list[str]:
        value, unit = record.objective * self.problem.objective.scale, self.problem.objective.unit
        cells = [
            f"{record.iteration:3d}",
            f"{record.phase:12s}",
            f"{value:.2f} kg {value * POUNDS_PER_KILOGRAM:.1f} lb" if unit == "kg" else f"{value:.6f} {unit}",
            f"{record.violation:.1e} {self.problem.constraint_label(record.worst_constraint)}",
            f"{record.stationarity:.1e}",
            _or_dash(record.penalty),
            f"{record.elapsed:.1f} s",
        ]
        if self.is_verbose:
            inner = str(record.inner) if record.inner else "-"
            cells += [inner, _or_dash(record.step), _or_dash(record.damping)]
            cells += [str(record.active), str(record.on_bounds), str(record.evaluations)]
        return cells

    def _table(self) -> Table:
        objective = self.problem.objective.name.replace("_", " ")
        heads = ["", "phase", objective, "worst constraint", "stationarity", "penalty", "time"]
        if self.is_verbose:
            heads += ["inner", "step", "damping", "rows active", "on bounds", "evaluations"]
        table = Table(*heads, box=SIMPLE, pad_edge=False)
        for record in self.records[-SHOWN_ROWS:]:
            table.add_row(*self._cells(record))
        return table


def _or_dash(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1e}"
