"""A different aircraft and mission from TOML files: shorter and lighter, one longer flight, a quieter limit.

`lpc-mdo init DIR` writes the baseline files to start from; here they are edited as a person would with an editor.
"""

import tempfile
from importlib import resources
from pathlib import Path

import torch

import lpc_mdo

EDITS = {
    "vehicle.toml": {
        'name = "NASA Lift+Cruise"': 'name = "Smaller air taxi"',
        "area_m2 = 19.536": "area_m2 = 16.0",
        "aspect_ratio = 12.1423": "aspect_ratio = 10.0",
        "mass_kg = 900.0": "mass_kg = 650.0",
        "specific_energy_Wh_per_kg = 400.0": "specific_energy_Wh_per_kg = 450.0",
    },
    "mission.toml": {
        "flights = 2": "flights = 1",
        "distance_m = 69450.0": "distance_m = 90000.0",
        "distance_m = 69200.0": "distance_m = 30000.0",
        "maximum_sound_pressure_level_dba = 67.0": "maximum_sound_pressure_level_dba = 62.0",
    },
}


def edited(folder: Path) -> list[Path]:
    """The shipped files with the changes above."""
    files = []
    for name, changes in EDITS.items():
        text = resources.files("lpc_mdo.data").joinpath(name).read_text(encoding="utf-8")
        for old, new in changes.items():
            assert old in text, old
            text = text.replace(old, new, 1)
        files.append(folder / name)
        files[-1].write_text(text, encoding="utf-8")
    return files


with tempfile.TemporaryDirectory() as folder:
    vehicle, mission = lpc_mdo.load(*edited(Path(folder)))
problem = lpc_mdo.gross_weight_problem(vehicle, mission)
with torch.no_grad():
    analysis = problem.analyze(problem.x0)

if __name__ == "__main__":
    # On the command line: lpc-mdo optimize vehicle.toml --mission mission.toml --output runs/other
    print(f"gross mass at the start {float(analysis.gross_mass):.0f} kg, span {float(analysis.shape.wing.span):.2f} m")
    print(f"state of charge after {mission.flights} flight: {float(analysis.energy.battery.final_state_of_charge):.3f}")
