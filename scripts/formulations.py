"""The published formulation of the 109-variable problem beside the reduced one: optimum, certificate, cost, in one run."""

import argparse

from rich.console import Console
from rich.table import Table

import lpc_mdo
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.problems.reduced import reduced_problem


@one_thread()
def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    keep_freed_memory()
    inputs = lpc_mdo.baseline()
    table = Table("", "paper", "reduced")
    results = [
        lpc_mdo.optimize(problem) for problem in (lpc_mdo.gross_weight_problem(*inputs), reduced_problem(*inputs))
    ]
    rows = {
        "status": lambda r: r["status"],
        "variables, rows": lambda r: f"{r['n_design_variables']}, {r['n_constraints']}",
        "gross mass, kg": lambda r: f"{r['objective']['value']:.9f}",
        "stationarity (scaled)": lambda r: f"{r['certificate']['stationarity']:.1e}",
        "violation (scaled)": lambda r: f"{r['certificate']['feasibility']:.1e}",
        "evaluations": lambda r: str(r["counts"]["evaluations"]),
        "seconds": lambda r: f"{r['timing']['optimize_s']:.1f}",
    }
    for name, cell in rows.items():
        table.add_row(name, *(cell(result) for result in results))
    Console().print(table)
    paper, reduced = (result.objective.value for result in results)
    Console().print(f"relative difference of the optima: {abs(reduced - paper) / paper:.1e}")


if __name__ == "__main__":
    main()
