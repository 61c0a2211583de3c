"""One optimization of one problem, from Python: the same content as a run folder's result.json."""

import time
from typing import Any

from torch import Tensor

from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import Hooks, OptimizationResult, Options, minimize_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file


@one_thread()
def minimum(problem: Problem, x0: Tensor, **options: Any) -> OptimizationResult:
    """The solver's result from x0 (n,) scaled; options and errors as `minimize_problem`."""
    return minimize_problem(
        problem.evaluate,
        x0,
        problem.lower,
        problem.upper,
        problem.constraint_lower,
        problem.constraint_upper,
        is_batched=True,
        **options,
    )


@one_thread()
def solve(
    problem: Problem,
    x0: Tensor | None = None,
    *,
    solver: str = "augmented-lagrangian",
    options: Options | None = None,
    hooks: Hooks | None = None,
    state: dict[str, Any] | None = None,
    started: float | None = None,
    multipliers: Tensor | None = None,
) -> tuple[OptimizationResult, dict[str, Any]]:
    """Optimize from x0 (n,) scaled, the initial design if left out; the solver's result and the content of result.json.

    `started`: time.monotonic() from which the timing counts, now if left out; `multipliers` (m,): those of a neighbouring
    optimum x0. Raises ValueError as `minimize_problem`.
    """
    started = time.monotonic() if started is None else started
    options = options or Options()
    setup = time.monotonic() - started
    start = problem.x0 if x0 is None else x0
    result = minimum(problem, start, solver=solver, options=options, hooks=hooks, state=state, multipliers=multipliers)
    optimized = time.monotonic() - started
    vehicle, mission = problem.analyze_design.vehicle, problem.analyze_design.mission
    content = result_file.build(problem, result, vehicle, mission, options, {})
    total = time.monotonic() - started
    content["timing"] = {
        "total_s": total,
        "setup_s": setup,
        "optimize_s": optimized - setup,
        "report_s": total - optimized,
    }
    return result, content


def optimize(problem: Problem, x0: Tensor | None = None, **options: Any) -> dict[str, Any]:
    """The content of result.json for the optimum of `problem`; arguments as `solve`."""
    return solve(problem, x0, **options)[1]
