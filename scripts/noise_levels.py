"""Levels of the lift rotors under every noise model and acoustic convention, as a table in Markdown.

    python scripts/noise_levels.py [RESULT.json]

Of the start and, where a result is given, of its design: 76.2 m away, at 85 and at 45 degrees from the disk plane.
"""

import argparse
from pathlib import Path

import torch

from lpc_mdo.config import Mission, Vehicle, load
from lpc_mdo.model.design import Design
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.stored.result import design_of, read_result

ELEVATIONS = (85.0, 45.0)
ROWS = {
    "tones, steady loads": ("tonal_dba", {}),
    "tones, unsteady loads": ("tonal_dba", {"tonal_model": "unsteady_loading"}),
    "broadband, Schlegel–King–Mull": ("broadband_dba", {}),
    "broadband, Gill–Lee": ("broadband_dba", {"broadband_model": "gill_lee"}),
    "broadband, Brooks–Pope–Marcolini": ("broadband_dba", {"broadband_model": "brooks_pope_marcolini"}),
    "total, `per_band`": ("total_dba", {}),
    "total, unweighted": ("total_db", {}),
    "total, `lsdo_acoustics_2023`": ("total_dba", {"acoustic_convention": "lsdo_acoustics_2023"}),
    "total, `acoustics_2022`": ("total_dba", {"acoustic_convention": "acoustics_2022"}),
}


def levels(inputs: tuple[Vehicle, Mission], designs: list[Design], level: str) -> list[float]:
    analyze = gross_weight_problem(*inputs).analyze_design
    with torch.no_grad():
        return [float(getattr(analyze(design).noise, level)) for design in designs]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", nargs="?", type=Path, help="result.json of the gross-weight problem")
    file = parser.parse_args().result
    problem = gross_weight_problem(*load())
    designs = {"start": problem.unpack(problem.x0)}
    if file is not None:
        designs["optimum"] = problem.unpack(problem.scaled(design_of(read_result(file))))
    print("| | " + " | ".join(f"{name}, {angle:g}°" for angle in ELEVATIONS for name in designs) + " |")
    print("|---" * (1 + len(ELEVATIONS) * len(designs)) + "|")
    for name, (level, choices) in ROWS.items():
        cells = []
        for angle in ELEVATIONS:
            keys = {"observer_elevation_deg": angle} | choices
            inputs = load(overrides=[f"mission.requirements.{key}={value}" for key, value in keys.items()])
            cells += [f"{value:.1f}" for value in levels(inputs, list(designs.values()), level)]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
