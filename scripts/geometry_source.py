"""The gross-weight problem through the full geometry, and with trapezoids in closed form in its place: optimum and time.

Run from the root of the repository: python scripts/geometry_source.py [--optimize]. Without the option only the time of
the model and its gradient is compared, alternating between both in one process; with it both are optimized, 2 minutes.
"""

import argparse
import time
from collections.abc import Callable
from contextlib import contextmanager
from statistics import median

import lpc_mdo
from lpc_mdo.geometry import parameterization
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.single import solve

WARM_UP = 5


@contextmanager
def closed_form():
    """Chords stretched as one and turned by the twist coefficients, in place of the parameterization solve."""
    full = parameterization.least_deformation
    parameterization.least_deformation = lambda measures, reference, weight, requested, start: (
        reference * requested[..., -1:]
    )
    try:
        yield
    finally:
        parameterization.least_deformation = full


@contextmanager
def full_geometry():
    yield


def seconds(problem: Problem, variant: Callable) -> float:
    """Processor time of one evaluation with gradient."""
    x = problem.x0.clone().requires_grad_()
    with variant():
        started = time.process_time()
        objective, rows = problem.evaluate(x)
        (objective + rows.sum()).backward()
        return time.process_time() - started


@one_thread()
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--optimize", action="store_true")
    parser.add_argument("--repetitions", type=int, default=35, help="of the comparison of time")
    arguments = parser.parse_args()
    problem = gross_weight_problem(*lpc_mdo.baseline())
    count = WARM_UP + arguments.repetitions
    pairs = [(seconds(problem, full_geometry), seconds(problem, closed_form)) for _ in range(count)][WARM_UP:]
    full, closed = (median(side) for side in zip(*pairs, strict=True))
    ratio = median(a / b for a, b in pairs)
    print(f"model and gradient: full {1e3 * full:.1f} ms, closed form {1e3 * closed:.1f} ms, ratio {ratio:.3f}")
    if arguments.optimize:
        masses = []
        for name, variant in (("full geometry", full_geometry), ("closed form", closed_form)):
            with variant():
                result, content = solve(problem)
            masses.append(content.objective.value)
            print(f"{name}: {masses[-1]:.3f} kg, {result.status}")
        print(f"difference {masses[0] / masses[1] - 1.0:.1e}")


if __name__ == "__main__":
    main()
