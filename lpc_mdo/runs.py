"""One optimization run in a folder: configuration, checkpoint, progress, result."""

import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from rich.console import Console
from rich.live import Live
from rich.table import Table

from lpc_mdo.config import ConfigurationError, Mission, Vehicle, load
from lpc_mdo.optimization import Hooks, Options, Progress, minimize_problem
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.tables import headline_table

CHECKPOINT = "checkpoint.json"
POUNDS_PER_KILOGRAM = 1.0 / 0.45359237
SHOWN_ROWS = 12


@dataclass(frozen=True)
class Request:
    """What the command line asks for."""

    vehicle: Path | None
    mission: Path | None
    overrides: tuple[str, ...]
    solver: str
    start: Path | None
    is_resuming: bool
    is_quiet: bool
    time_limit: float
    output: Path


def optimize(request: Request, started: float) -> int:
    """Run and write; returns the exit code. `started` is time.monotonic() at process start."""
    vehicle, mission = load(request.vehicle, request.mission, request.overrides)
    if request.output.exists() and not request.output.is_dir():
        raise ConfigurationError(f"--output {request.output} is not allowed; it exists and is not a folder.")
    problem = gross_weight_problem(vehicle, mission)
    x0 = problem.x0 if request.start is None else _stored_design(request.start, problem)
    digest = result_file.configuration_sha256(vehicle, mission)
    state = _read_checkpoint(request, digest) if request.is_resuming else None
    request.output.mkdir(parents=True, exist_ok=True)
    _write_configuration(vehicle, mission, request.output)

    def save(state: dict[str, Any]) -> None:
        content = {"schema": "lpc-mdo/checkpoint/1", "configuration_sha256": digest, "state": state}
        result_file.write_atomically(request.output / CHECKPOINT, json.dumps(content))

    options = Options(time_limit=request.time_limit)
    console = Console(quiet=request.is_quiet)
    setup = time.monotonic() - started
    with _Display(console, problem) as display:
        result = minimize_problem(
            problem.evaluate,
            x0,
            problem.lower,
            problem.upper,
            problem.constraint_lower,
            problem.constraint_upper,
            solver=request.solver,
            options=options,
            hooks=Hooks(progress=display.add, checkpoint=save),
            state=state,
        )
    optimized = time.monotonic() - started
    timing = {"total_s": optimized, "setup_s": setup, "optimize_s": optimized - setup, "report_s": 0.0}
    content = result_file.build(problem, result, vehicle, mission, options, timing)
    timing["total_s"] = time.monotonic() - started
    timing["report_s"] = timing["total_s"] - optimized
    content["timing"] = timing
    result_file.write_history(result, problem, request.output)
    result_file.write_result(content, request.output)
    _report(console, content, problem, result.certificate, request.output)
    return 0 if result.status == "converged" else 1


def _report(console: Console, content: dict[str, Any], problem: Problem, certificate: Any, folder: Path) -> None:
    console.print(headline_table(content))
    proof = content["certificate"]
    console.print(
        f"status: {content['status']} ({content['message']}); {content['n_design_variables']} variables, "
        f"{content['n_constraints']} constraints; stationarity {proof['stationarity']:.1e}, "
        f"violation {proof['feasibility']:.1e}, complementarity {proof['complementarity']:.1e} (scaled)"
    )
    if content["status"] != "converged":
        worst_row = problem.constraint_label(certificate.worst_constraint)
        worst_variable = problem.variable_label(certificate.worst_variable)
        console.print(f"worst constraint: {worst_row}; worst variable: {worst_variable}")
    console.print(
        f"{content['timing']['total_s']:.1f} s, {content['counts']['evaluations']} evaluations; wrote {folder}"
    )


def _stored_design(file: Path, problem: Problem) -> torch.Tensor:
    """Scaled x of a stored result of the same problem."""
    stored = _read_json(file)
    try:
        values = {entry["name"]: entry["value"] for entry in stored["design_variables"]}
        return problem.scaled(values)
    except (KeyError, TypeError, RuntimeError) as error:
        raise ConfigurationError(f"{file}: is not a result of this problem: {error}.") from None


def _read_json(file: Path) -> dict[str, Any]:
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"{file}: cannot be read: {error.strerror}.") from None
    except ValueError as error:
        raise ConfigurationError(f"{file}: is not valid JSON: {error}.") from None


def _read_checkpoint(request: Request, digest: str) -> dict[str, Any]:
    file = request.output / CHECKPOINT
    if request.solver != "augmented-lagrangian":
        raise ConfigurationError(f"--resume is not allowed with --solver {request.solver}; it keeps no checkpoint.")
    content = _read_json(file)
    if content.get("schema") != "lpc-mdo/checkpoint/1":
        raise ConfigurationError(f"{file}: schema = {content.get('schema')!r} is not allowed.")
    if content["configuration_sha256"] != digest:
        raise ConfigurationError(f"{file}: belongs to another vehicle or mission; run without --resume.")
    return content["state"]


def _write_configuration(vehicle: Vehicle, mission: Mission, folder: Path) -> None:
    content = {"vehicle": vehicle.model_dump(), "mission": mission.model_dump()}
    result_file.write_atomically(folder / "configuration.json", json.dumps(content, indent=1) + "\n")


class _Display:
    """A live table in a terminal, plain lines elsewhere."""

    def __init__(self, console: Console, problem: Problem) -> None:
        self.console, self.problem = console, problem
        self.records: list[Progress] = []
        self.live = Live(console=console, refresh_per_second=4) if console.is_terminal else None

    def __enter__(self) -> "_Display":
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
            self.console.print("  ".join(self._cells(record)), soft_wrap=True)

    def _cells(self, record: Progress) -> list[str]:
        mass = record.objective * self.problem.objective.scale
        return [
            record.phase,
            str(record.iteration),
            f"{mass:.2f} kg",
            f"{mass * POUNDS_PER_KILOGRAM:.1f} lb",
            f"{record.violation:.1e}",
            self.problem.constraint_label(record.worst_constraint),
            f"{record.stationarity:.1e}",
            f"{record.elapsed:.1f} s",
        ]

    def _table(self) -> Table:
        heads = ("phase", "iteration", "gross mass", "", "violation", "worst constraint", "stationarity", "time")
        table = Table(*heads)
        for record in self.records[-SHOWN_ROWS:]:
            table.add_row(*self._cells(record))
        return table
