"""The published problem from Python, a script to start from: aircraft and mission in, the lightest design out.

    python scripts/optimize.py [VEHICLE] [--mission FILE] [--set KEY=VALUE ...]

`lpc-mdo init DIR` writes files to edit; `lpc-mdo optimize` adds a run folder, checkpoints and a report.
"""

import argparse

import lpc_mdo
from lpc_mdo.optimization import Options

POUND = 0.45359237  # kg


def short(value: float | list[float]) -> str:
    return ", ".join(f"{number:.4g}" for number in (value if isinstance(value, list) else [value]))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicle", nargs="?", help="vehicle file; default: the shipped one")
    parser.add_argument("--mission", help="mission file; default: the shipped one")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="as in lpc-mdo optimize")
    parser.add_argument("--time-limit", type=float, default=float("inf"), metavar="S", help="seconds; default: none")
    asked = parser.parse_args()

    try:
        options = Options(time_limit=asked.time_limit)
        vehicle, mission = lpc_mdo.load(asked.vehicle, asked.mission, asked.set)
        problem = lpc_mdo.gross_weight_problem(vehicle, mission)
    except ValueError as error:  # a file, a value or a start that cannot be used, in one sentence
        parser.error(str(error))
    print(f"{problem.size} variables, {len(problem.constraints)} constraints")

    result = lpc_mdo.optimize(problem, options=options)

    outputs = result.outputs
    print(f"{result.status}: {result.message}")
    before, after = outputs["mass_breakdown_initial_kg"], outputs["mass_breakdown_kg"]
    total = {"gross mass": (outputs["gross_mass_initial_kg"], outputs["gross_mass_kg"])}
    for name, (start, end) in ({name: (before[name], after[name]) for name in after} | total).items():
        print(f"{name:24} {start:9.1f} kg -> {end:9.1f} kg  ({end / POUND:7.1f} lb)")
    print("active limits, and what one unit of each costs in kg:")
    for row in result.constraints:
        if row.kind == "inequality" and row.active:
            print(f"{row.name:24} {short(row.value)} {row.unit}: {short(row.multiplier)} kg")
    return 0 if result.is_converged else 1


if __name__ == "__main__":
    raise SystemExit(main())
