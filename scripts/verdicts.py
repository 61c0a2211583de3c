"""Whether verdicts stand: settings far from the default's, each by several solvers, as one table.

    python scripts/verdicts.py [--only noise] [--solvers sqp,slsqp] [--output DIR]

A cell is the optimum's gross mass in kg (reduced formulation), or the status, and seconds of processor time; REFUTED stands
beside "infeasible" where another solver has reached a design that violates nothing. The last line tells the least sound pressure
level that Newton's method finds from the quietest optimum: where feasibility ends. What is done is kept in DIR (default:
runs/verdicts), and not repeated. Exit code 1: a verdict of our own solvers is refuted.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from lpc_mdo.config import load
from lpc_mdo.files.write import write_atomically
from lpc_mdo.numerics.memory import keep_freed_memory
from lpc_mdo.optimization import Options
from lpc_mdo.optimization.registry import OPTIMIZERS
from lpc_mdo.problems.problem import Objective, Problem
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.studies.single import minimum

OURS = ("sqp", "augmented-lagrangian")
LIMIT = "mission.requirements.maximum_sound_pressure_level_dba"
SETTINGS = {
    **{f"noise limit {level} dB(A)": (f"{LIMIT}={level}",) for level in (*range(56, 65), 67)},
    "structure x 3": ("vehicle.structure.calibration_factor=3.0",),
    "hover 400 s": ("mission.hover.duration_s=400",),
    "two more passengers": ("vehicle.fixed_masses.3.mass_kg=381.375",),
    "twice the reserve": ("mission.reserve.distance_m=138400",),
    "250 Wh/kg": ("vehicle.battery.specific_energy_Wh_per_kg=250",),
    "500 Wh/kg": ("vehicle.battery.specific_energy_Wh_per_kg=500",),
    "final charge 0.1": ("mission.requirements.minimum_final_state_of_charge=0.1",),
    "final charge 0.5": ("mission.requirements.minimum_final_state_of_charge=0.5",),
    "drag by build-up": ("vehicle.drag.source=build_up",),
}


def problem_with(overrides: tuple[str, ...]) -> Problem:
    return reduced_problem(*load(None, None, overrides))


def solved(problem: Problem, solver: str, start: Any = None) -> dict[str, Any]:
    began = time.process_time()
    result = minimum(problem, problem.x0 if start is None else start, solver=solver, options=Options())
    if result.status == "interrupted":
        raise KeyboardInterrupt
    return {
        "status": result.status,
        "message": result.message,
        "objective": result.objective * problem.objective.scale,
        "violation": result.certificate.feasibility,
        "evaluations": result.counts.evaluations,
        "processor_s": time.process_time() - began,
        "x": result.x.tolist(),
    }


def quietest(problem: Problem) -> Problem:
    """The problem whose objective is the sound pressure level, under all other rows."""
    (level,) = (row for row in problem.constraints if row.name == "sound_pressure_level")
    objective = Objective("sound_pressure_level", "dB(A)", lambda a: level.of(a).reshape(a.gross_mass.shape), 10.0)
    return replace(problem, objective=objective, constraints=tuple(r for r in problem.constraints if r is not level))


def is_refuted(cells: dict[str, dict[str, Any]], solver: str) -> bool:
    """Another solver stands at a design that violates nothing."""
    reached = any(cell["violation"] <= Options().feasibility_tolerance for cell in cells.values())
    return cells[solver]["status"] == "infeasible" and reached


def cell_words(cells: dict[str, dict[str, Any]], solver: str) -> str:
    cell = cells[solver]
    words = f"{cell['objective']:.4f}" if cell["status"] == "converged" else cell["status"].replace("_", " ")
    return f"{words}{', REFUTED' if is_refuted(cells, solver) else ''} ({cell['processor_s']:.0f} s)"


class Kept:
    """What was solved, in a file."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.file = folder / "verdicts.json"
        self.content = json.loads(self.file.read_text()) if self.file.exists() else {}

    def get(self, key: str, make: Any) -> dict[str, Any]:
        if key not in self.content:
            self.content[key] = make()
            write_atomically(self.file, json.dumps(self.content, indent=1))
        return self.content[key]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="WORD", help="only settings with this word in their name")
    parser.add_argument("--solvers", default="sqp,augmented-lagrangian,slsqp", help="names with commas between them")
    parser.add_argument("--output", type=Path, default=Path("runs/verdicts"), metavar="DIR")
    asked = parser.parse_args()
    solvers = asked.solvers.split(",")
    if unknown := [name for name in solvers if name not in OPTIMIZERS]:
        parser.error(f"solver {unknown[0]!r} is unknown: it must be one of {', '.join(OPTIMIZERS)}")
    if not (settings := {name: sets for name, sets in SETTINGS.items() if asked.only in name}):
        parser.error(f"--only {asked.only!r} names none of {', '.join(SETTINGS)}")
    keep_freed_memory()
    kept, is_true, quiet = Kept(asked.output), True, {}
    print(f"| setting | {' | '.join(solvers)} |\n{'|---' * (len(solvers) + 1)}|")
    for name, sets in settings.items():
        problem = problem_with(sets)
        cells = {}
        for solver in solvers:
            cells[solver] = kept.get(f"{name}, {solver}", lambda p=problem, s=solver: solved(p, s))
        print(f"| {name} | {' | '.join(cell_words(cells, solver) for solver in solvers)} |", flush=True)
        is_true &= not any(is_refuted(cells, solver) for solver in solvers if solver in OURS)
        optima = [cell for cell in cells.values() if cell["status"] == "converged"]
        if optima and name.startswith("noise"):
            quiet[name] = optima[0]
    if quiet:
        least = next(name for name in settings if name in quiet)
        start, problem = quiet[least]["x"], quietest(problem_with(settings[least]))
        found = kept.get(f"least level from {least}", lambda: solved(problem, "sqp", problem.x0.new_tensor(start)))
        print(f"least level from the optimum at {least}: {found['objective']:.4f} dB(A), {found['status']}")
    return 0 if is_true else 1


if __name__ == "__main__":
    raise SystemExit(main())
