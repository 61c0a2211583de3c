"""One optimization run in a folder: configuration, checkpoint, progress, result."""

import json
import math
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

from lpc_mdo.config import load
from lpc_mdo.input_files import ConfigurationError
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.optimization import Hooks, OptimizationResult, Options, Progress
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.presolve import presolve
from lpc_mdo.optimization.registry import OPTIMIZERS
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum
from lpc_mdo.problems.choice import chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.diagnosis import words
from lpc_mdo.reporting.files import write_atomically
from lpc_mdo.reporting.flag_lines import flag_lines
from lpc_mdo.reporting.tables import headline_table
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.stored.checkpoint import SCHEMA as CHECKPOINT_SCHEMA
from lpc_mdo.stored.checkpoint import read_checkpoint
from lpc_mdo.stored.designs import scaled_design
from lpc_mdo.stored.result import read_result
from lpc_mdo.studies.single import solve

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
    for line in flag_lines(content["flags"]):
        style = "bold red" if line.is_loud else ""
        console.print(f"outside the models' regime: {line.text}", style=style, highlight=False, markup=False)
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
        for line in words(content["diagnosis"], content["objective"], content["status"]):
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
    return scaled_design(read_result(file), file, problem)


def _read_checkpoint(request: Request, digest: str, problem: Problem) -> dict[str, Any]:
    if not OPTIMIZERS[request.solver].keeps_checkpoints:
        raise ConfigurationError(f"--resume is not allowed with --solver {request.solver}; it keeps no checkpoint.")
    file = request.output / CHECKPOINT
    state = read_checkpoint(file, digest, problem.size, sum(problem.row_sizes), request.solver)
    if state["newton"] is not None:
        for key, size in zip(("x", "multipliers"), solved_sizes(problem), strict=True):
            if len(state["newton"][key]) != size:
                raise ConfigurationError(
                    f"{file}: state.newton.{key} must hold {size} finite numbers; run without --resume."
                )
    return state


def solved_sizes(problem: Problem) -> tuple[int, int]:
    """Numbers of variables and rows that the solver is left with once it has solved the affine rows."""
    limits = (problem.lower, problem.upper, problem.constraint_lower, problem.constraint_upper)
    solved = presolve(Evaluator(problem.evaluate, *(t.numpy() for t in limits), is_batched=True), problem.x0.numpy())
    return len(solved.variables), len(solved.rows)


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
