"""Evaluations of every installed solver on the problems of Hock and Schittkowski, as a table: python scripts/compare_solvers.py.

A number is that of evaluations of objective and constraints, those for second derivatives included; "-" stands where a solver
misses the optimum by more than 1e-6, relative, or the constraints by more than 1e-8.
"""

import argparse
import importlib.util
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from hock_schittkowski import FLAT, PROBLEMS, TIGHT, optimum, solve, violation

from lpc_mdo.optimization.registry import OPTIMIZERS as SOLVERS

RELATIVE, FEASIBLE = 1e-6, 1e-8


def row(case: dict, solver: str) -> tuple[int | None, float]:
    """Evaluations, None where the optimum is missed; relative error."""
    options = replace(TIGHT, stationarity_tolerance=FLAT.get(case["name"], TIGHT.stationarity_tolerance))
    result = solve(case, solver=solver, options=options)
    error = abs(result.objective - optimum(case)) / max(1.0, abs(optimum(case)))
    is_solved = error <= RELATIVE and violation(case, result.x) <= FEASIBLE
    return (result.counts.evaluations if is_solved else None), error


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    warnings.simplefilter("ignore")
    solvers = [name for name in SOLVERS if name != "ipopt" or importlib.util.find_spec("cyipopt")]
    print("| problem | variables | rows | " + " | ".join(solvers) + " | error of ours |")
    print("|---" * (len(solvers) + 4) + "|")
    table = {name: [] for name in solvers}
    for case in PROBLEMS:
        found = {name: row(case, name) for name in solvers}
        for name in solvers:
            table[name].append(found[name][0])
        cells = ["-" if found[name][0] is None else str(found[name][0]) for name in solvers]
        size = f"{case['n']} | {len(case['equalities']) + len(case['inequalities'])}"
        print(f"| {case['name']} | {size} | {' | '.join(cells)} | {found[solvers[0]][1]:.0e} |", flush=True)
    known = {name: [count for count in counts if count is not None] for name, counts in table.items()}
    print("| solved | | | " + " | ".join(f"{len(known[name])} of {len(PROBLEMS)}" for name in solvers) + " | |")
    print("| median | | | " + " | ".join(f"{median(known[name]):g}" for name in solvers) + " | |")


if __name__ == "__main__":
    main()
