"""Figures of noise and motors: python scripts/acoustics.py FOLDER [RESULT.json]; of the start if no result is given."""

import sys
from pathlib import Path

import torch

from lpc_mdo.config import load
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting import style
from lpc_mdo.reporting.acoustics import acoustic_figures
from lpc_mdo.stored.designs import scaled_design
from lpc_mdo.stored.result import read_result


def main(folder: Path, result: Path | None) -> None:
    vehicle, mission = load()
    problem = gross_weight_problem(vehicle, mission)
    x = problem.x0
    if result is not None:
        x = scaled_design(read_result(result), result, problem)
    folder.mkdir(parents=True, exist_ok=True)
    with torch.no_grad(), style.look():
        for name, figure in acoustic_figures(problem.analyze(x), vehicle, mission).items():
            figure.savefig(folder / f"{name}.png", dpi=90)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
