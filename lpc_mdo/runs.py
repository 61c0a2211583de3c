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
from lpc_mdo.optimization.registry import DEFAULT, OPTIMIZERS
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum
from lpc_mdo.problems.choice import chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.diagnosis import words
from lpc_mdo.reporting.files import locked, make_folder, write_atomically
from lpc_mdo.reporting.flag_lines import flag_lines
from lpc_mdo.reporting.tables import headline_table
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.signals import finishing, stoppable
from lpc_mdo.stored.checkpoint import FILE as CHECKPOINT
from lpc_mdo.stored.checkpoint import HISTORY, CheckpointWriter, read_checkpoint
from lpc_mdo.stored.designs import start_design
from lpc_mdo.stored.result import read_result
from lpc_mdo.stored.starts import FILE as STARTS_FILE
from lpc_mdo.stored.study import FILE as STUDY_FILE
from lpc_mdo.studies.single import Clock, content_of, minimum

RESULTS = ("result.json", "analysis.json", "history.csv", "evaluations.csv", "report.html", "sensitivities.json")
STARTS = (STARTS_FILE, "starts.svg", "starts.png")
FILES = (CHECKPOINT, HISTORY, *RESULTS, *STARTS)
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


def run_request(request: Request, started: float) -> int:
    """Run and write what the command line asks for; returns the exit code. `started` is time.monotonic() at process start."""
    if request.is_resuming and request.start is not None:
        raise ConfigurationError("--start is not allowed with --resume; a resumed run starts at its checkpoint.")
    keep_freed_memory()
    vehicle, mission = load(request.vehicle, request.mission, request.overrides)
    require_folder(request.output)
    problem = chosen_problem(vehicle, mission, request.blades, request.is_reduced)
    x0 = problem.x0 if request.start is None else _stored_design(request.start, problem)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the run warns; input that is refused gets one message
        state = _read_checkpoint(request, _digest(problem), problem) if request.is_resuming else None
        _require_finite(problem, x0)
    with locked(request.output):
        content, is_reported = _carry_out(
            problem,
            x0,
            terminal(request.is_quiet),
            request.output,
            started,
            is_verbose=request.is_verbose,
            solver=request.solver,
            options=Options(time_limit=request.time_limit),
            state=state,
        )
    return 0 if content["status"] == "converged" and is_reported else 1


def optimize(
    problem: Problem,
    x0: torch.Tensor | None = None,
    *,
    output: Path | str | None = None,
    progress: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """The content of result.json for the optimum of `problem` from x0 (n,) scaled, default: the initial design.

    output: a folder for all that `lpc-mdo optimize` writes (result, checkpoint, report), default: nothing is written.
    progress: show the iterations and the outcome in the terminal. Further options as `lpc_mdo.studies.single.solve`
    (solver, options, hooks, state, started, multipliers). Ctrl-C and SIGTERM end the search with status "interrupted".
    Raises ValueError as `minimize_problem`, and ConfigurationError where another process works in the folder.
    """
    started = options.pop("started", None) or time.monotonic()
    start, console = problem.x0 if x0 is None else x0, terminal(is_quiet=not progress)
    if output is None:
        return _carry_out(problem, start, console, None, started, **options)[0]
    with locked(Path(output)):
        return _carry_out(problem, start, console, Path(output), started, **options)[0]


def _carry_out(
    problem: Problem,
    x0: torch.Tensor,
    console: Console,
    folder: Path | None,
    started: float,
    *,
    is_verbose: bool = False,
    solver: str = DEFAULT,
    options: Options | None = None,
    hooks: Hooks | None = None,
    **how: Any,
) -> tuple[dict[str, Any], bool]:
    """Optimize, write the folder and tell; the content of result.json, and whether everything asked for was written."""
    set_up, options, trace = time.monotonic(), options or Options(), Trace(problem)
    if folder is not None:
        write_configuration(problem, folder, is_fresh=how.get("state") is None)
    with finishing("the result is being written; once more gives it up"):
        with _Display(console, problem, is_verbose) as display, stoppable("stopping with the newest design ..."):
            watching = _hooks(hooks or Hooks(), display, trace, problem, folder, solver)
            result = minimum(problem, x0, solver=solver, options=options, hooks=watching, **how)
        content = content_of(problem, result, options, Clock(started, set_up, time.monotonic()))
        is_reported = folder is None or write_run(problem, result, content, trace, folder, started)
    tell(console, content, problem, result.certificate, folder)
    return content, is_reported


def _hooks(own: Hooks, display: "_Display", trace: Trace, problem: Problem, folder: Path | None, solver: str) -> Hooks:
    """The caller's own, and ours after them."""
    kept = None if folder is None else CheckpointWriter(folder, _digest(problem), solver)

    def progress(record: Progress) -> None:
        own.progress(record)
        display.add(record)

    def checkpoint(state: dict[str, Any]) -> None:
        own.checkpoint(state)
        if kept is not None:
            kept.write(state)

    def evaluation(objective: torch.Tensor, constraints: torch.Tensor) -> None:
        own.evaluation(objective, constraints)
        trace.add(objective, constraints)

    return Hooks(progress, checkpoint, evaluation)


def _digest(problem: Problem) -> str:
    whole = problem.analyze_design
    return result_file.configuration_sha256(whole.vehicle, whole.mission, problem.settings)


def require_folder(output: Path) -> None:
    """Raises ConfigurationError if the output is there and no folder, or holds a study."""
    if output.exists() and not output.is_dir():
        raise ConfigurationError(f"--output {output} is not allowed; it exists and is not a folder.")
    if (output / STUDY_FILE).exists():
        raise ConfigurationError(f"--output {output} is not allowed; it holds a study: name another folder.")


def write_configuration(problem: Problem, folder: Path, is_fresh: bool) -> None:
    """Write the resolved inputs into the run folder; a fresh run removes what an earlier one left there.

    Raises ConfigurationError where the folder holds a study or cannot be made.
    """
    require_folder(folder)
    make_folder(folder)
    if is_fresh:
        for file in (*(folder / name for name in FILES), *(folder / "figures").glob("*.[sp][vn]g")):
            file.unlink(missing_ok=True)
    whole = problem.analyze_design
    configuration = result_file.configuration(whole.vehicle, whole.mission, problem.settings)
    write_atomically(folder / "configuration.json", json.dumps(configuration, indent=1) + "\n")


def write_run(
    problem: Problem, result: OptimizationResult, content: dict[str, Any], trace: Trace, folder: Path, started: float
) -> bool:
    """Every file of the run folder but configuration and checkpoint; `content` is that of result.json.

    The result comes first: whatever fails afterwards is told in a warning, and False returned.
    """
    result_file.write_result(content, folder)
    try:
        result_file.write_history(result, problem, folder)
        trace.write(folder)
        from lpc_mdo.reporting import analysis_file  # here, since an optimization need not wait for Matplotlib

        analysis_file.write(analysis_file.build(problem, result), folder)
        _render(content, folder, started)
    except Exception as error:  # whatever it is, the optimum stands
        reason = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
        warnings.warn(f"{folder / 'result.json'} is whole, but the report could not be written: {reason}", stacklevel=2)
        return False
    return True


def _render(content: dict[str, Any], folder: Path, started: float) -> None:
    """Figures and report.html of a stored run, and the time they took."""
    from lpc_mdo.reporting.report import write_report

    optimized = time.monotonic() - started
    write_report(folder)
    total = time.monotonic() - started
    content["timing"] |= {"total_s": total, "report_s": content["timing"]["report_s"] + total - optimized}
    result_file.write_result(content, folder)


def tell(console: Console, content: dict[str, Any], problem: Problem, certificate: Any, folder: Path | None) -> None:
    """What a run has come to, in the terminal."""
    console.print(headline_table(content))
    for line in flag_lines(content["flags"]):
        style = "bold red" if line.is_loud else ""
        console.print(f"outside the models' regime: {line.text}", style=style, highlight=False)
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
    written = "" if folder is None else f"; wrote {folder}"
    console.print(f"{content['timing']['total_s']:.1f} s, {content['counts']['evaluations']} evaluations{written}")


def _require_finite(problem: Problem, x: torch.Tensor) -> None:
    with torch.no_grad():
        objective, constraints = problem.evaluate(x)
    if not bool(objective.isfinite() & constraints.isfinite().all()):
        raise ConfigurationError("the start is not allowed; the objective or a constraint is not finite there.")


def _stored_design(file: Path, problem: Problem) -> torch.Tensor:
    """Scaled x of a stored result with the same variables."""
    return start_design(read_result(file), file, problem)


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
