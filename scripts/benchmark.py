"""Time and operators of one evaluation of the 109-variable problem, alone and in batches, side by side in one run."""

import cProfile
import pstats
import statistics
import time
from collections.abc import Callable

import torch
from rich.console import Console
from rich.table import Table
from torch.profiler import ProfilerActivity, profile

import lpc_mdo

REPETITIONS = 15
BATCHES = (8, 24, 68)
PARTS = {
    "_propulsion": "rotors and motors",
    "_aerodynamics": "vortex lattice, drag, stall",
    "geometry": "geometry",
    "_noise": "noise",
    "_weights": "masses",
    "_trim": "trim",
}


def median_milliseconds(action: Callable[[], object]) -> float:
    """Median processor time of a call."""
    action()
    times = []
    for _ in range(REPETITIONS):
        started = time.process_time()
        action()
        times.append(time.process_time() - started)
    return 1e3 * statistics.median(times)


def operators(action: Callable[[], object]) -> int:
    """ATen calls of a call, those inside others included."""
    with profile(activities=[ProfilerActivity.CPU]) as recorded:
        action()
    return sum(event.count for event in recorded.key_averages() if event.key.startswith("aten::"))


def main() -> None:
    torch.set_num_threads(1)
    problem = lpc_mdo.gross_weight_problem(*lpc_mdo.baseline())

    def value() -> None:
        with torch.no_grad():
            problem.evaluate(problem.x0)

    def gradient(count: int = 1) -> None:
        x = problem.x0.repeat(count, 1).requires_grad_()
        objective, rows = problem.evaluate(x)
        torch.autograd.grad(objective.sum() + rows.sum(), x)

    table = Table("evaluation", "processor time, ms", "ms a design", "of one alone", "ATen calls")
    alone = median_milliseconds(gradient)
    single = median_milliseconds(value)
    table.add_row("value", f"{single:.1f}", f"{single:.1f}", "", str(operators(value)))
    table.add_row("value and gradient", f"{alone:.1f}", f"{alone:.1f}", "1.00", str(operators(gradient)))
    for count in BATCHES:
        cost = median_milliseconds(lambda count=count: gradient(count))
        table.add_row(
            f"the same, {count} designs", f"{cost:.1f}", f"{cost / count:.1f}", f"{cost / count / alone:.2f}", ""
        )
    profiler = cProfile.Profile()
    profiler.runcall(lambda: [value() for _ in range(REPETITIONS)])
    total = dict.fromkeys(PARTS, 0.0)
    for (file, _, name), (_, _, _, cumulative, _) in pstats.Stats(profiler).stats.items():
        key = "geometry" if file.endswith("geometry/shape.py") and name == "__call__" else name
        if key in total and (key == "geometry" or file.endswith("analysis.py")):
            total[key] += cumulative
    whole = sum(total.values())
    parts = Table("part of the value", "share")
    for key, label in PARTS.items():
        parts.add_row(label, f"{100.0 * total[key] / whole:.0f} %")
    for item in (table, parts):
        Console().print(item)


if __name__ == "__main__":
    main()
