"""One optimization of one problem: the solver's result, and the same in engineering terms."""

import time
from dataclasses import dataclass
from typing import Any

from torch import Tensor

from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import Hooks, OptimizationResult, Options, minimize_problem
from lpc_mdo.optimization.model import Evaluate
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting import result_file
from lpc_mdo.stored.result import Result, Timing


@one_thread()
def minimum(problem: Problem, x0: Tensor, evaluate: Evaluate | None = None, **options: Any) -> OptimizationResult:
    """The solver's result from x0 (n,) scaled; options and errors as `minimize_problem`.

    `evaluate`: asked in place of the problem's own, as by a hub.
    """
    return minimize_problem(
        problem.evaluate if evaluate is None else evaluate,
        x0,
        problem.lower,
        problem.upper,
        problem.constraint_lower,
        problem.constraint_upper,
        is_batched=True,
        **options,
    )


@dataclass(frozen=True)
class Clock:
    """When a run began, was set up and was optimized: time.monotonic(), s."""

    started: float
    set_up: float
    optimized: float


@one_thread()
def result_of(problem: Problem, found: OptimizationResult, options: Options, clock: Clock) -> Result:
    """What the solver found in engineering terms: outputs, rows in their units, provenance."""
    vehicle, mission = problem.analyze_design.vehicle, problem.analyze_design.mission
    result = result_file.build(problem, found, vehicle, mission, options, {})
    now = time.monotonic()
    timing = Timing.model_construct(
        total_s=now - clock.started,
        setup_s=clock.set_up - clock.started,
        optimize_s=clock.optimized - clock.set_up,
        report_s=now - clock.optimized,
    )
    return result.model_copy(update={"timing": timing})


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
    evaluate: Evaluate | None = None,
) -> tuple[OptimizationResult, Result]:
    """Optimize from x0 (n,) scaled, default: the initial design; the solver's result, and the same in engineering terms.

    `started`: time.monotonic() from which the timing counts, default: now; `multipliers` (m,): those of a neighbouring
    optimum x0; `evaluate`: asked in place of the problem's own. Raises ValueError as `minimize_problem`.
    """
    set_up = time.monotonic()
    options = options or Options()
    start = problem.x0 if x0 is None else x0
    how = {"solver": solver, "options": options, "hooks": hooks, "state": state, "multipliers": multipliers}
    found = minimum(problem, start, evaluate, **how)
    clock = Clock(set_up if started is None else started, set_up, time.monotonic())
    return found, result_of(problem, found, options, clock)
