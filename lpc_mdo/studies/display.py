"""Progress of a study: a bar with the time left in a terminal, lines elsewhere, and the table at its end."""

import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from lpc_mdo.reporting import wording
from lpc_mdo.reporting.flag_lines import study_flag_lines
from lpc_mdo.reporting.stored import read_study
from lpc_mdo.reporting.weight_parts import parts_table, weight_parts
from lpc_mdo.studies.study import Study

STOPPING = "stopping; finished points are kept: add --resume to go on ..."


class StudyDisplay:
    """`landed` is called with every point that finishes and the number of points that are left."""

    def __init__(self, console: Console, study: Study) -> None:
        self.console, self.study = console, study
        self.started, self.count = time.monotonic(), 0
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
        )
        self.progress = Progress(*columns, TextColumn("{task.fields[left]}"), console=console)
        self.bar = self.progress.add_task(study.name, total=len(study.values), left="")

    def __enter__(self) -> "StudyDisplay":
        if self.console.is_terminal:
            self.progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def landed(self, entry: dict[str, Any], left: int) -> None:
        """Show a finished point; the time left assumes that the others take as long as those so far."""
        self.count += 1
        remaining = left * (time.monotonic() - self.started) / self.count
        text = f"about {remaining:.0f} s left" if left else "all points done"
        self.progress.update(self.bar, completed=len(self.study.values) - left, left=text)
        outcome = "" if entry["position"] is None else f"  {_cells(self.study, entry)[1]}"
        self.progress.console.print(
            f"{self.study.parameter.name} = {entry['value']:.6g}: {entry['status']}{outcome}; {text}",
            soft_wrap=True,
            highlight=False,
        )

    def table(self, content: dict[str, Any], folder: Path) -> None:
        """All points, what is on the front, and both slopes."""
        axes, parameter = self.study.axes, self.study.parameter
        is_own_axis = axes[0].name == parameter.name
        heads = [_title(axis.name, axis.unit) for axis in axes[is_own_axis:]]
        per = axes[1].unit if axes[0].unit == "1" else f"{axes[1].unit}/({axes[0].unit})"
        slopes = [f"slope by {source}, {per}" for source in ("multipliers", "points")]
        table = Table(_title(parameter.name, parameter.unit), *heads, *slopes, "status", "on front")
        for point in content["points"]:
            values = [_number(point["slope"][key]) for key in ("from_multipliers", "from_points")]
            on_front = {None: "", True: "yes", False: "no"}[point["is_on_front"]]
            cells = _cells(self.study, point)[is_own_axis:]
            table.add_row(f"{point['value']:.6g}", *cells, *values, point["status"], on_front)
        self.console.print(table)
        parts = weight_parts(read_study(folder))
        if len(parts) > 1:
            self.console.print(
                "What more speed costs, kg: the slowest aircraft of the front, and what the others have more"
            )
            self.console.print(parts_table(parts))
        for point in content["points"]:
            if point["status"] != "converged":
                self.console.print(f"{point['value']:.6g}: {point['status']}: {point['message']}", soft_wrap=True)
        for line in study_flag_lines(content["points"], wording.quantity(parameter.name)):
            words, style = f"outside the models' regime: {line.text}", "bold red" if line.is_loud else ""
            self.console.print(words, style=style, soft_wrap=True, markup=False, highlight=False)
        timing = content["timing"]
        self.console.print(f"{timing['wall_s']:.1f} s, {timing['processor_s']:.1f} s of processor time; wrote {folder}")


def _title(name: str, unit: str) -> str:
    return wording.quantity(name) + (f", {unit}" if unit != "1" else "")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"


def _cells(study: Study, entry: dict[str, Any]) -> list[str]:
    if entry["position"] is None:
        return ["-", "-"]
    return [f"{value:.5g}" if abs(value) < 1e3 else f"{value:.2f}" for value in entry["position"]]
