"""One optimization run in a folder: configuration, checkpoint, progress, result."""

import json
import time
import warnings
from pathlib import Path
from typing import Any

import torch
from rich.console import Console

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked, make_folder, write_atomically
from lpc_mdo.optimization import Hooks, OptimizationResult, Options, Progress
from lpc_mdo.optimization.certificate import Certificate
from lpc_mdo.optimization.registry import DEFAULT
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.diagnosis import words
from lpc_mdo.reporting.flag_lines import flag_lines
from lpc_mdo.reporting.tables import headline_table
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.stored.checkpoint import FILE as CHECKPOINT
from lpc_mdo.stored.checkpoint import HISTORY, CheckpointWriter
from lpc_mdo.stored.result import Result
from lpc_mdo.stored.starts import FILE as STARTS_FILE
from lpc_mdo.stored.study import FILE as STUDY_FILE
from lpc_mdo.studies.run_display import RunDisplay
from lpc_mdo.studies.signals import finishing, stoppable
from lpc_mdo.studies.single import Clock, minimum, result_of

RESULTS = ("result.json", "analysis.json", "history.csv", "evaluations.csv", "report.html", "sensitivities.json")
STARTS = (STARTS_FILE, "starts.svg", "starts.png")
FILES = (CHECKPOINT, HISTORY, *RESULTS, *STARTS)


def optimize(
    problem: Problem,
    x0: torch.Tensor | None = None,
    *,
    output: Path | str | None = None,
    progress: bool = False,
    **options: Any,
) -> Result:
    """The optimum of `problem` from x0 (n,) scaled, default: the initial design.

    output: a folder for all that `lpc-mdo optimize` writes (result, checkpoint, report), default: nothing is written.
    progress: show the iterations and the outcome in the terminal. Further options as `lpc_mdo.studies.single.solve`
    (solver, options, hooks, state, started, multipliers). Ctrl-C and SIGTERM end the search with status "interrupted".
    Raises ValueError as `minimize_problem`, and ConfigurationError where another process works in the folder.
    """
    started = options.pop("started", None) or time.monotonic()
    start, console = problem.x0 if x0 is None else x0, terminal(is_quiet=not progress)
    if output is None:
        return carry_out(problem, start, console, None, started, **options)[0]
    with locked(Path(output)):
        return carry_out(problem, start, console, Path(output), started, **options)[0]


def carry_out(
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
) -> tuple[Result, bool]:
    """Optimize, write the folder and tell; the result, and whether everything asked for was written."""
    set_up, options, trace = time.monotonic(), options or Options(), Trace(problem)
    if folder is not None:
        write_configuration(problem, folder, is_fresh=how.get("state") is None)
    with finishing("the result is being written; once more gives it up"):
        with RunDisplay(console, problem, is_verbose) as display, stoppable("stopping with the newest design ..."):
            watching = _hooks(hooks or Hooks(), display, trace, problem, folder, solver)
            found = minimum(problem, x0, solver=solver, options=options, hooks=watching, **how)
        result, is_reported = result_of(problem, found, options, Clock(started, set_up, time.monotonic())), True
        if folder is not None:
            result, is_reported = write_run(problem, found, result, trace, folder, started)
    tell(console, result, problem, found.certificate, folder)
    return result, is_reported


def _hooks(own: Hooks, display: RunDisplay, trace: Trace, problem: Problem, folder: Path | None, solver: str) -> Hooks:
    """The caller's own, and ours after them."""
    kept = None if folder is None else CheckpointWriter(folder, configuration_digest(problem), solver)

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


def configuration_digest(problem: Problem) -> str:
    """Of everything that a checkpoint must agree with."""
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
    problem: Problem, found: OptimizationResult, result: Result, trace: Trace, folder: Path, started: float
) -> tuple[Result, bool]:
    """Every file of the run folder but configuration and checkpoint; the result with all times, and whether all is written.

    result.json comes first: whatever fails afterwards is told in a warning.
    """
    result_file.write_result(result, folder)
    try:
        result_file.write_history(found, problem, folder)
        trace.write(folder)
        from lpc_mdo.reporting import analysis_file  # here, since an optimization need not wait for Matplotlib

        analysis_file.write(analysis_file.build(problem, found), folder)
        return _render(result, folder, started), True
    except Exception as error:  # whatever it is, the optimum stands
        reason = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
        warnings.warn(f"{folder / 'result.json'} is whole, but the report could not be written: {reason}", stacklevel=2)
        return result, False


def _render(result: Result, folder: Path, started: float) -> Result:
    """Figures and report.html of a stored run; the result with the time they took, stored again."""
    from lpc_mdo.reporting.report import write_report

    optimized = time.monotonic() - started
    write_report(folder)
    total = time.monotonic() - started
    spent = {"total_s": total, "report_s": result.timing.report_s + total - optimized}
    result = result.model_copy(update={"timing": result.timing.model_copy(update=spent)})
    result_file.write_result(result, folder)
    return result


def tell(console: Console, result: Result, problem: Problem, certificate: Certificate, folder: Path | None) -> None:
    """What a run has come to, in the terminal."""
    content = result.content()
    console.print(headline_table(content))
    for line in flag_lines(content["flags"]):
        style = "bold red" if line.is_loud else ""
        console.print(f"outside the models' regime: {line.text}", style=style, highlight=False)
    console.print(
        f"status: {content['status']} ({content['message']}); {content['n_design_variables']} variables, "
        f"{content['n_constraints']} constraints; stationarity {certificate.stationarity:.1e}, "
        f"violation {certificate.feasibility:.1e}, complementarity {certificate.complementarity:.1e} (scaled)"
    )
    if content["status"] != "converged":
        worst_row = problem.constraint_label(certificate.worst_constraint)
        worst_variable = problem.variable_label(certificate.worst_variable)
        console.print(f"worst constraint: {worst_row}; worst variable: {worst_variable}")
        for sentence in words(content["diagnosis"], content["objective"], content["status"]):
            console.print(sentence, highlight=False)
    written = "" if folder is None else f"; wrote {folder}"
    console.print(f"{content['timing']['total_s']:.1f} s, {content['counts']['evaluations']} evaluations{written}")
