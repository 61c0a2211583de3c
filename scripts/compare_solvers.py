"""Solvers on problems with known minima, as a table: python scripts/compare_solvers.py [--solvers sqp,slsqp] [--problems NAME].

A number is that of evaluations of objective and constraints, those for second derivatives included, where the solver claims an
optimum and its objective is one to 1e-6, relative; a word is the status that it tells otherwise. FALSE stands where the claim
is not true: an optimum that is none, or no design where there are some.
"""

import argparse
import importlib.util
import sys
import warnings
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from optimization_problems import ALL, Case

from lpc_mdo.optimization.registry import OPTIMIZERS


def cell(case: Case, solver: str) -> tuple[str, int | None]:
    """What the table says, and evaluations where an optimum was found."""
    result = case.solve(solver=solver)
    if case.is_false(result):
        return f"FALSE {result.status}", None
    if result.status == "converged":
        return str(result.counts.evaluations), result.counts.evaluations
    return result.status.replace("_", " "), None


def main() -> int:
    installed = [name for name in OPTIMIZERS if name != "ipopt" or importlib.util.find_spec("cyipopt")]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--solvers", default=",".join(installed), help="names with commas between them")
    parser.add_argument("--problems", default="", help="only problems whose names begin so")
    asked = parser.parse_args()
    solvers = asked.solvers.split(",")
    if unknown := [name for name in solvers if name not in installed]:
        parser.error(f"solver {unknown[0]!r} is unknown or not installed; there are {', '.join(installed)}")
    warnings.simplefilter("ignore")
    print(f"| problem | variables | {' | '.join(solvers)} |\n{'|---' * (len(solvers) + 2)}|")
    counts, false = {name: [] for name in solvers}, dict.fromkeys(solvers, 0)
    cases = [case for case in ALL if case.name.startswith(asked.problems)]
    for case in cases:
        cells = []
        for name in solvers:
            words, count = cell(case, name)
            cells.append(words)
            false[name] += words.startswith("FALSE")
            counts[name] += [] if count is None else [count]
        print(f"| {case.name} | {len(case.x0)} | {' | '.join(cells)} |", flush=True)
    print(f"| optima of {len(cases)} problems | | {' | '.join(str(len(counts[name])) for name in solvers)} |")
    print(f"| median of evaluations | | {' | '.join(f'{median(counts[name] or [0]):g}' for name in solvers)} |")
    print(f"| false claims | | {' | '.join(str(false[name]) for name in solvers)} |")
    return 1 if any(false[name] for name in ("sqp", "augmented-lagrangian") if name in false) else 0


if __name__ == "__main__":
    sys.exit(main())
