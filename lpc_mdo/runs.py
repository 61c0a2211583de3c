"""One optimization run in a folder: configuration, checkpoint, progress, result."""

import json
import math
import sys
import time
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from rich.box import SIMPLE
from rich.console import Console
from rich.live import Live
from rich.table import Table

from lpc_mdo.config import ConfigurationError, load, read_json
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.optimization import Hooks, OptimizationResult, Options, Progress
from lpc_mdo.optimization.newton import stored_point
from lpc_mdo.optimization.registry import OPTIMIZERS
from lpc_mdo.optimization.search import STAGES
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum
from lpc_mdo.problems.choice import chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.diagnosis import words
from lpc_mdo.reporting.files import write_atomically
from lpc_mdo.reporting.tables import headline_table
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.studies.single import solve

CHECKPOINT = "checkpoint.json"
CHECKPOINT_SCHEMA = "lpc-mdo/checkpoint/1"
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
    blades: tuple[WeightedSum, Observer] | None  # the aeroacoustic problem; None: the gross-weight problem
    is_verbose: bool = False  # inner iterations, steps and active sets in the progress display
    is_reduced: bool = False  # the gross-weight problem in its reduced formulation


def optimize(request: Request, started: float) -> int:
    """Run and write; returns the exit code. `started` is time.monotonic() at process start."""
    if request.is_resuming and request.start is not None:
        raise ConfigurationError("--start is not allowed with --resume; a resumed run starts at its checkpoint.")
    keep_freed_memory()
    vehicle, mission = load(request.vehicle, request.mission, request.overrides)
    require_folder(request.output)
    problem = chosen_problem(vehicle, mission, request.blades, request.is_reduced)
    x0 = problem.x0 if request.start is None else _stored_design(request.start, problem)
    digest = result_file.configuration_sha256(vehicle, mission, problem.settings)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the run warns; input that is refused gets one message
        state = _read_checkpoint(request, digest, problem) if request.is_resuming else None
        _require_finite(problem, x0)
    write_configuration(problem, request.output)

    def save(state: dict[str, Any]) -> None:
        content = {
            "schema": CHECKPOINT_SCHEMA,
            "configuration_sha256": digest,
            "solver": request.solver,
            "state": state,
        }
        write_atomically(request.output / CHECKPOINT, json.dumps(content))

    console, trace = Console(quiet=request.is_quiet), Trace(problem)
    with _Display(console, problem, request.is_verbose) as display:
        result, content = solve(
            problem,
            x0,
            solver=request.solver,
            options=Options(time_limit=request.time_limit),
            hooks=Hooks(progress=display.add, checkpoint=save, evaluation=trace.add),
            state=state,
            started=started,
        )
    write_run(problem, result, content, trace, request.output, started)
    tell(console, content, problem, result.certificate, request.output)
    return 0 if result.status == "converged" else 1


def require_folder(output: Path) -> None:
    """Raises ConfigurationError if the output is there and no folder."""
    if output.exists() and not output.is_dir():
        raise ConfigurationError(f"--output {output} is not allowed; it exists and is not a folder.")


def write_configuration(problem: Problem, folder: Path) -> None:
    """Make the run folder and write the resolved inputs into it. Raises ConfigurationError where that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"--output {folder} is not allowed: {error.strerror}.") from None
    whole = problem.analyze_design
    configuration = result_file.configuration(whole.vehicle, whole.mission, problem.settings)
    write_atomically(folder / "configuration.json", json.dumps(configuration, indent=1) + "\n")


def write_run(
    problem: Problem, result: OptimizationResult, content: dict[str, Any], trace: Trace, folder: Path, started: float
) -> None:
    """Every file of the run folder but configuration and checkpoint; `content` is that of result.json."""
    result_file.write_history(result, problem, folder)
    trace.write(folder)
    result_file.write_result(content, folder)
    from lpc_mdo.reporting import analysis_file  # here, since an optimization need not wait for Matplotlib

    analysis_file.write(analysis_file.build(problem, result), folder)
    _render(content, folder, started)


def _render(content: dict[str, Any], folder: Path, started: float) -> None:
    """Figures and report.html of a stored run, and the time they took."""
    from lpc_mdo.reporting.report import write_report

    optimized = time.monotonic() - started
    write_report(folder)
    total = time.monotonic() - started
    content["timing"] |= {"total_s": total, "report_s": content["timing"]["report_s"] + total - optimized}
    result_file.write_result(content, folder)


def tell(console: Console, content: dict[str, Any], problem: Problem, certificate: Any, folder: Path) -> None:
    """What a run has come to, in the terminal."""
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
        for line in words(content["diagnosis"], content["objective"]):
            console.print(line, highlight=False)
    console.print(
        f"{content['timing']['total_s']:.1f} s, {content['counts']['evaluations']} evaluations; wrote {folder}"
    )


def _require_finite(problem: Problem, x: torch.Tensor) -> None:
    with torch.no_grad():
        objective, constraints = problem.evaluate(x)
    if not bool(objective.isfinite() & constraints.isfinite().all()):
        raise ConfigurationError("the start is not allowed; the objective or a constraint is not finite there.")


def _stored_design(file: Path, problem: Problem) -> torch.Tensor:
    """Scaled x of a stored result of the same problem."""
    stored = read_json(file)
    try:
        values = {entry["name"]: entry["value"] for entry in stored["design_variables"]}
    except (KeyError, TypeError):
        raise ConfigurationError(f"{file}: design_variables is missing; it must be a result.json.") from None
    for variable in problem.variables:
        if variable.name not in values:
            raise ConfigurationError(f"{file}: design variable {variable.name} is missing.")
        if not _are_numbers(values[variable.name], variable.size):
            shape = " x ".join(str(size) for size in variable.size) or "1"
            raise ConfigurationError(f"{file}: design variable {variable.name} must hold {shape} finite numbers.")
    return problem.scaled(values)


def _are_numbers(value: object, shape: tuple[int, ...]) -> bool:
    """Finite numbers in nested lists of that shape."""
    if shape:
        return isinstance(value, list) and len(value) == shape[0] and all(_are_numbers(v, shape[1:]) for v in value)
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _read_checkpoint(request: Request, digest: str, problem: Problem) -> dict[str, Any]:
    file = request.output / CHECKPOINT
    if not OPTIMIZERS[request.solver].keeps_checkpoints:
        raise ConfigurationError(f"--resume is not allowed with --solver {request.solver}; it keeps no checkpoint.")
    content = read_json(file)
    schema = content.get("schema") if isinstance(content, dict) else None
    if schema != CHECKPOINT_SCHEMA:
        raise ConfigurationError(f"{file}: schema = {schema!r} is not allowed; it must be {CHECKPOINT_SCHEMA!r}.")
    if content.get("configuration_sha256") != digest:
        raise ConfigurationError(f"{file}: belongs to another vehicle or mission; run without --resume.")
    if content.get("solver") != request.solver:
        raise ConfigurationError(
            f"{file}: solver = {content.get('solver')!r} wrote it; --resume needs the same, here {request.solver!r}."
        )
    state, rows = content.get("state"), sum(problem.row_sizes)
    shapes = {"x": (problem.size,), "multipliers": (rows,), "constraint_scale": (rows,)}
    single = ("penalty", "outer", "tolerance", "last_violation", "last_progress", "objective_scale", "damping")
    shapes |= dict.fromkeys(single, ())
    for key, shape in shapes.items():
        if not isinstance(state, dict) or not _are_numbers(state.get(key), shape):
            count = shape[0] if shape else 1
            raise ConfigurationError(f"{file}: state.{key} must hold {count} finite numbers; run without --resume.")
    if "progress" not in state or not (state["progress"] is None or _are_numbers(state["progress"], ())):
        raise ConfigurationError(f"{file}: state.progress must be a finite number or null; run without --resume.")
    if state.get("stage") not in STAGES or not isinstance(state.get("is_doubtful"), bool):
        raise ConfigurationError(f"{file}: state.stage or state.is_doubtful is damaged; run without --resume.")
    try:
        if state["newton"] is not None:
            stored_point(state["newton"])
    except (KeyError, TypeError, ValueError):
        raise ConfigurationError(f"{file}: state.newton is damaged; run without --resume.") from None
    try:
        elapsed = [Progress(**record).elapsed for record in state["history"]]
    except (KeyError, TypeError):
        elapsed = [None]
    if not _are_numbers(elapsed, (len(elapsed),)):
        raise ConfigurationError(f"{file}: state.history is damaged; run without --resume.")
    return state


class _Display:
    """A live table in a terminal, plain lines elsewhere; `is_verbose` adds inner iterations, steps and active sets."""

    def __init__(self, console: Console, problem: Problem, is_verbose: bool) -> None:
        self.console, self.problem, self.is_verbose = console, problem, is_verbose
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
