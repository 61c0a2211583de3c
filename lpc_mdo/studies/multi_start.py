"""`lpc-mdo optimize --starts N`: many scattered starts, where they end, and the best of them as the run's result."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from lpc_mdo.config import load
from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked, write_atomically
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.optimization import Hooks, Options
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import style
from lpc_mdo.reporting.figures import starts as starts_figure
from lpc_mdo.reporting.style import save
from lpc_mdo.reporting.tables import POUNDS_PER_KILOGRAM
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.stored import starts as starts_file
from lpc_mdo.stored.designs import multipliers_by_row, scaled_design
from lpc_mdo.stored.result import read_result
from lpc_mdo.stored.tables import read_history
from lpc_mdo.studies import runs, start_summary
from lpc_mdo.studies.display import STOPPING, StudyDisplay
from lpc_mdo.studies.lockstep import Lockstep
from lpc_mdo.studies.points import multipliers_of
from lpc_mdo.studies.run_request import Request
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.signals import finishing, stoppable
from lpc_mdo.studies.single import solve
from lpc_mdo.studies.starts import Scatter, scattered_starts
from lpc_mdo.studies.study import Study

STUDY_FOLDER = "starts"
RESOLUTION = 150  # dots per inch
BATCH = 10  # starts at a time: more gain little, and take memory


@dataclass(frozen=True)
class Scattering:
    """What the command line asks for beyond a run: number of starts, seed, reach as a share of ranges, processes."""

    count: int
    seed: int
    reach: float
    jobs: int


def optimize(request: Request, scattering: Scattering, started: float) -> int:
    """Run all starts, write the run folder of the best; returns the exit code: 0 if every start converged."""
    if request.start is not None:
        raise ConfigurationError("--start is not allowed with --starts; starts are drawn around the baseline.")
    vehicle, mission = load(request.vehicle, request.mission, request.overrides)
    runs.require_folder(request.output)
    keep_freed_memory()
    study = scattered_starts(
        vehicle,
        mission,
        request.case,
        scattering.count,
        scattering.seed,
        scattering.reach,
        request.is_reduced,
    )
    with locked(request.output):
        return _run(request, scattering, study, started)


def _scatter(study: Study) -> Scatter:
    """Where the study's starts come from. Raises TypeError for a study of another kind."""
    if not isinstance(study.problems, Scatter):
        raise TypeError(f"a study of kind {study.kind!r} has no scattered starts")
    return study.problems


def _run(request: Request, scattering: Scattering, study: Study, started: float) -> int:
    scatter = _scatter(study)
    problem = scatter.problem
    runs.write_configuration(problem, request.output, is_fresh=not request.is_resuming)
    folder, console = request.output / STUDY_FOLDER, terminal(request.is_quiet)
    options = Options(time_limit=request.time_limit)
    executor = Lockstep(BATCH, scattering.jobs)
    with StudyDisplay(console, study) as display, stoppable(STOPPING):
        whole = StudyRun(study, folder, executor, request.solver, options, display.landed).run(request.is_resuming)
    with finishing("the result is being written; once more gives it up"):
        return _conclude(request, scattering, study, whole, console, started)


def _conclude(
    request: Request,
    scattering: Scattering,
    study: Study,
    whole: dict[str, Any],
    console: Console,
    started: float,
) -> int:
    """Summary, picture and the best start's run folder from the content of the finished study.json; the exit code."""
    scatter = _scatter(study)
    problem = scatter.problem
    folder, numbers = request.output / STUDY_FOLDER, range(1, scattering.count + 1)
    summary = start_summary.summarize(whole, folder, scatter.violations(numbers))
    drawn = {"seed": scattering.seed, "reach": scattering.reach, "objective": _objective(problem)}
    write_atomically(request.output / starts_file.FILE, json.dumps(summary | drawn, indent=1, allow_nan=False) + "\n")
    _draw(summary, folder, _objective(problem), request.output)
    _show(console, summary, problem, request.output)
    if summary["best_start"] is None:
        console.print("no start converged: there is no result")
        return 1
    best = folder / whole["points"][summary["best_start"] - 1]["folder"]
    is_reported = _write_best(request, problem, best, console, started)
    return 0 if summary["converged"] == summary["count"] and is_reported else 1


def _objective(problem: Problem) -> dict[str, str]:
    return {"name": problem.objective.name, "unit": problem.objective.unit}


def _write_best(request: Request, problem: Problem, best: Path, console: Console, started: float) -> bool:
    """The run's files for the best start's design, certified anew as an optimum of the problem with the baseline as start."""
    stored = read_result(best / "result.json")
    multipliers = multipliers_of(problem, multipliers_by_row(stored, best / "result.json", problem))
    trace = Trace(problem)
    with torch.no_grad():
        trace.add(*problem.evaluate(problem.x0))
    found, result = solve(
        problem,
        scaled_design(stored, best / "result.json", problem),
        solver="sqp",  # from an optimum and its multipliers Newton's method has little to do
        options=Options(time_limit=request.time_limit),
        hooks=Hooks(evaluation=trace.add),
        started=started,
        multipliers=multipliers,
    )
    result, is_reported = runs.write_run(problem, found, result, trace, request.output, started)
    runs.tell(console, result, problem, found.certificate, request.output)
    return is_reported


def _draw(summary: dict[str, Any], folder: Path, objective: dict[str, str], output: Path) -> None:
    """starts.svg and starts.png, from stored files."""
    histories = []
    for row in summary["starts"]:
        file = folder / row["folder"] / "history.csv"
        histories.append(read_history(file, objective) if file.exists() else [])
    with style.look():
        figure = starts_figure.draw(summary, histories, objective)
        for format in ("svg", "png"):
            save(figure, output / f"starts.{format}", dpi=RESOLUTION)


def _show(console: Console, summary: dict[str, Any], problem: Problem, output: Path) -> None:
    is_mass = problem.objective.unit == "kg"
    heads = ["mass, kg", "lb"] if is_mass else ["objective"]
    table = Table("start", "violation", *heads, "off, %", "converged", "designs", "s", box=SIMPLE, padding=(0, 1))
    for row in summary["starts"]:
        table.add_row(*_cells(row, is_mass))
    console.print(table)
    for row in summary["starts"]:
        if row["status"] != "converged":
            console.print(f"start {row['start']}: {row['status']}: {row['message']}", soft_wrap=True)
    console.print(
        f"{summary['converged']} of {summary['count']} starts converged, {summary['near_best']} within "
        f"{100.0 * summary['near']:g} % of the best; {output / 'starts.png'} shows them"
    )
    console.print(summary["verdict"], soft_wrap=True, highlight=False)
    for optimum in summary["optima"]:
        for line in _optimum_lines(optimum):
            console.print(line, soft_wrap=True, highlight=False)


def _cells(row: dict[str, Any], is_mass: bool) -> list[str]:
    value, distance, time = row["objective"], row["distance_to_best"], row["time_s"]
    violation = "-" if row["initial_violation"] is None else f"{row['initial_violation']:.2g}"
    values = ["-"] * (1 + is_mass)
    if value is not None:
        values = [f"{value:.3f}", f"{value * POUNDS_PER_KILOGRAM:.2f}"] if is_mass else [f"{value:.7f}"]
    return [
        str(row["start"]),
        violation,
        *values,
        "-" if distance is None else f"{100.0 * distance:.5f}",
        "no" if row["optimum"] is None else f"yes, {row['optimum']}",
        "-" if row["evaluations"] is None else str(row["evaluations"]),
        "-" if time is None else f"{time['wall']:.1f}",
    ]


def _optimum_lines(optimum: dict[str, Any]) -> list[str]:
    """One optimum in words: who ends there, how it differs from the best, and how far its own starts lie apart."""
    count = len(optimum["starts"])
    lines = [f"optimum {optimum['name']}: {optimum['objective']:.6g}, {count} start{'s' if count > 1 else ''}"]
    for title, key in (("differs from A in", "from_best"), ("designs of this optimum lie apart in", "within")):
        parts = [
            f"{entry['name']} {entry['here']:.4g} against {entry['there']:.4g} {entry['unit']} ({entry['share']:.1%} of its range)"
            for entry in optimum[key]
        ]
        if parts:
            lines.append(f"  {title} {'; '.join(parts)}")
    return lines
