"""Time of the noise-efficiency front against one optimization of the same problem, in one run.

    python scripts/benchmark_front.py [--points 11] [--repeats 3]

First both as commands, from process start to the last file; then solver time alone: every optimization from the baseline on
its own, all in one batch, and each from its neighbour's optimum as the study runner does without a batch. All are processor
times.
"""

import argparse
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace

from lpc_mdo.config import load
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.problems.aeroacoustic import WeightedSum, aeroacoustic_front
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.single import minimum
from lpc_mdo.studies.study import generations, starting_points
from lpc_mdo.studies.together import solve_together


def alone(problem: Problem, start: OptimizationResult | None = None) -> OptimizationResult:
    if start is None:
        return minimum(problem, problem.x0)
    return minimum(problem, start.x, multipliers=start.multipliers)


def from_neighbours(problems: list[Problem]) -> list[OptimizationResult]:
    starts, found = starting_points(len(problems)), {}
    for wave in generations(starts):
        for i in wave:
            found[i] = alone(problems[i], None if starts[i] is None else found[starts[i]])
    return [found[i] for i in range(len(problems))]


def timed(work: Callable[[], object]) -> tuple[float, object]:
    begun = time.process_time()
    result = work()
    return time.process_time() - begun, result


def command_seconds(*arguments: str) -> float:
    """Processor time of the whole command, in a folder of its own."""
    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", "from lpc_mdo.cli import main; main()", *arguments]
        subprocess.run([*command, "--quiet", "--output", f"{folder}/run"], check=True)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ended.ru_utime - begun.ru_utime + ended.ru_stime - begun.ru_stime


@one_thread()
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=11)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    single = command_seconds("optimize", "--problem", "aeroacoustic")
    front = command_seconds("pareto", "noise-efficiency")
    print(f"commands: one optimization {single:.2f} s, front of 11 {front:.2f} s, {front / single:.2f} x one")
    weights = [i / (arguments.points - 1) for i in range(arguments.points)]
    problems = aeroacoustic_front(*load(), [WeightedSum(weight) for weight in weights])
    (default,) = aeroacoustic_front(*load(), [WeightedSum()])
    default = replace(default, analyze_design=problems[0].analyze_design)
    default.evaluate(default.x0)  # first calls load libraries

    one, batch, chain = [], [], []
    for _ in range(arguments.repeats):  # in turns, so that a busy machine slows all alike
        one.append(timed(lambda: alone(default))[0])
        seconds, together = timed(lambda: solve_together(problems))
        batch.append(seconds)
        seconds, neighbours = timed(lambda: from_neighbours(problems))
        chain.append(seconds)
    separate = [timed(lambda problem=problem: alone(problem)) for problem in problems]

    print(f"{'weight':>6}  {'batch':>12}  {'alone':>12}  {'neighbours':>12}  {'alone, s':>8}")
    for weight, ours, (seconds, own), warm in zip(weights, together, separate, neighbours, strict=True):
        values = [f"{r.objective:12.7f}" if r.status == "converged" else f"{r.status:>12}" for r in (ours, own, warm)]
        print(f"{weight:6.2f}  {'  '.join(values)}  {seconds:8.2f}")
    single = statistics.median(one)
    everyone = sum(seconds for seconds, _ in separate)
    rows = {
        f"one optimization, weight {WeightedSum().noise_weight:g}": single,
        "mean of the weights, each alone": everyone / len(problems),
        f"front of {len(problems)}, in one batch": statistics.median(batch),
        f"front of {len(problems)}, from neighbours": statistics.median(chain),
        f"front of {len(problems)}, each alone": everyone,
    }
    for name, seconds in rows.items():
        print(f"{name:40} {seconds:7.2f} s  {seconds / single:5.2f} x one")


if __name__ == "__main__":
    main()
