"""Figures of noise and motors, of the baseline's start or of a stored result: python scripts/acoustics.py FOLDER [RESULT.json]."""

import argparse
from pathlib import Path

import torch

from lpc_mdo.config import load
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting import style
from lpc_mdo.reporting.acoustics import acoustic_figures
from lpc_mdo.stored.designs import scaled_design
from lpc_mdo.stored.result import read_result


@one_thread()
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="for the pictures; made if it is not there")
    parser.add_argument("result", type=Path, nargs="?", help="result.json whose design is drawn; default: the start")
    given = parser.parse_args()
    folder, result = given.folder, given.result
    vehicle, mission = load()
    problem = gross_weight_problem(vehicle, mission)
    x = problem.x0
    if result is not None:
        x = scaled_design(read_result(result), result, problem)
    folder.mkdir(parents=True, exist_ok=True)
    with torch.no_grad(), style.look():
        for name, figure in acoustic_figures(problem.analyze(x)).items():
            style.save(figure, folder / f"{name}.png", dpi=90)


if __name__ == "__main__":
    main()
