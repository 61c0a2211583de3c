"""A run as the command line asks for it: its files read, its start and checkpoint checked, its exit code."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from lpc_mdo.config import load
from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.optimization import Options
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.presolve import presolve
from lpc_mdo.optimization.registry import OPTIMIZERS
from lpc_mdo.problems.choice import Case, chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.stored.checkpoint import FILE as CHECKPOINT
from lpc_mdo.stored.checkpoint import read_checkpoint
from lpc_mdo.stored.designs import start_design
from lpc_mdo.stored.result import read_result
from lpc_mdo.studies import runs


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
    case: Case
    is_verbose: bool = False  # inner iterations, steps and active sets in the progress display
    is_reduced: bool = False  # the gross-weight problem in its reduced formulation


def run_request(request: Request, started: float) -> int:
    """Run and write what the command line asks for; returns the exit code. `started` is time.monotonic() at process start."""
    if request.is_resuming and request.start is not None:
        raise ConfigurationError("--start is not allowed with --resume; a resumed run starts at its checkpoint.")
    keep_freed_memory()
    vehicle, mission = load(request.vehicle, request.mission, request.overrides)
    runs.require_folder(request.output)
    problem = chosen_problem(vehicle, mission, request.case, request.is_reduced)
    x0 = problem.x0 if request.start is None else _stored_design(request.start, problem)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the run warns; input that is refused gets one message
        state = _read_checkpoint(request, runs.configuration_digest(problem), problem) if request.is_resuming else None
        _require_finite(problem, x0)
    with locked(request.output):
        result, is_reported = runs.carry_out(
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
    return 0 if result.is_converged and is_reported else 1


def _require_finite(problem: Problem, x: torch.Tensor) -> None:
    """Raises ConfigurationError with the row that has no value at the start, or why the start has none at all."""
    try:
        with torch.no_grad():
            objective, constraints = problem.evaluate(x)
    except ArithmeticError as error:
        raise ConfigurationError(f"the start is invalid: {error}; it must be an aircraft that has a shape.") from None
    parts = {problem.objective.name: objective}
    parts |= zip((row.name for row in problem.constraints), constraints.split(problem.row_sizes, dim=-1), strict=True)
    for name, values in parts.items():
        if not bool(values.isfinite().all()):
            raise ConfigurationError(f"the start is invalid: {name} is not finite there; it must be.")


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
    evaluator = Evaluator(
        problem.evaluate,
        problem.lower.numpy(),
        problem.upper.numpy(),
        problem.constraint_lower.numpy(),
        problem.constraint_upper.numpy(),
        is_batched=True,
    )
    solved = presolve(evaluator, problem.x0.numpy())
    return len(solved.variables), len(solved.rows)
