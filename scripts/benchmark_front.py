"""Time of studies whose points are solved side by side: the noise-efficiency front, and scattered starts.

    python scripts/benchmark_front.py [--points 11] [--repeats 3]
    python scripts/benchmark_front.py --against CHECKOUT [--repeats 1] [--starts 10]

The first prints solver time of the front: every optimization from the baseline on its own, all in one hub, and each from its
neighbour's optimum as the study runner does without a hub. The second runs the commands `pareto noise-efficiency` and, unless
--starts is 0, `optimize --starts 10` with this code and with that of another checkout in turns, from process start to the last
file, and prints ratios. All are processor times.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from lpc_mdo.config import load
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.problems.aeroacoustic import WeightedSum, aeroacoustic_front
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.single import minimum
from lpc_mdo.studies.study import generations, starting_points
from lpc_mdo.studies.together import solve_together

HERE = Path(__file__).resolve().parents[1]


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


def command_seconds(tree: Path, *arguments: str) -> float:
    """Processor time of the whole command with the code of a checkout, in a folder of its own."""
    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", "from lpc_mdo.cli import main; main()", *arguments]
        environment = os.environ | {"PYTHONPATH": str(tree)}
        subprocess.run([*command, "--quiet", "--output", f"{folder}/run"], check=True, cwd=folder, env=environment)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ended.ru_utime - begun.ru_utime + ended.ru_stime - begun.ru_stime


def compare(other: Path, repeats: int, starts: int) -> None:
    """Both commands with both codes, in turns, so that a busy machine slows both alike."""
    commands = {"front of 11": ("pareto", "noise-efficiency")}
    if starts:
        commands[f"{starts} scattered starts"] = ("optimize", "--starts", str(starts))
    for name, command in commands.items():
        ours, theirs = [], []
        for _ in range(repeats):
            theirs.append(command_seconds(other, *command))
            ours.append(command_seconds(HERE, *command))
        here, there = statistics.median(ours), statistics.median(theirs)
        print(f"{name:22} {there:8.2f} s there  {here:8.2f} s here  {here / there:5.2f} x", flush=True)


@one_thread()
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=11)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--against", type=Path, metavar="CHECKOUT")
    parser.add_argument("--starts", type=int, default=10)
    arguments = parser.parse_args()
    if arguments.against:
        compare(arguments.against.resolve(), arguments.repeats, arguments.starts)
        return
    weights = [i / (arguments.points - 1) for i in range(arguments.points)]
    problems = aeroacoustic_front(*load(), [WeightedSum(weight) for weight in weights])
    (default,) = aeroacoustic_front(*load(), [WeightedSum()])
    default = replace(default, analyze_design=problems[0].analyze_design)
    default.evaluate(default.x0)  # first calls load libraries

    one, batch, chain = [], [], []
    for _ in range(arguments.repeats):  # in turns, so that a busy machine slows all alike
        one.append(timed(lambda: alone(default))[0])
        seconds, endings = timed(lambda: solve_together(problems))
        batch.append(seconds)
        seconds, neighbours = timed(lambda: from_neighbours(problems))
        chain.append(seconds)
    separate = [timed(lambda problem=problem: alone(problem)) for problem in problems]

    print(f"{'weight':>6}  {'hub':>12}  {'alone':>12}  {'neighbours':>12}  {'alone, s':>8}")
    together = [ending.unwrap() for ending in endings]
    for weight, ours, (seconds, own), warm in zip(weights, together, separate, neighbours, strict=True):
        values = [f"{r.objective:12.7f}" if r.status == "converged" else f"{r.status:>12}" for r in (ours, own, warm)]
        print(f"{weight:6.2f}  {'  '.join(values)}  {seconds:8.2f}")
    single = statistics.median(one)
    everyone = sum(seconds for seconds, _ in separate)
    rows = {
        f"one optimization, weight {WeightedSum().noise_weight:g}": single,
        "mean of the weights, each alone": everyone / len(problems),
        f"front of {len(problems)}, in one hub": statistics.median(batch),
        f"front of {len(problems)}, from neighbours": statistics.median(chain),
        f"front of {len(problems)}, each alone": everyone,
    }
    for name, seconds in rows.items():
        print(f"{name:40} {seconds:7.2f} s  {seconds / single:5.2f} x one")


if __name__ == "__main__":
    main()
