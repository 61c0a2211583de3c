"""A lift+cruise aircraft with four large lift rotors on one boom a side, from a vehicle file.

The numbers of variables and constraints follow the file. Here the shipped file's eight rotors are replaced; a person would do
it with an editor.
"""

import re
import tempfile
from importlib import resources
from pathlib import Path

import torch

import lpc_mdo

# Name, hub in m, spin. Mirror pairs turn oppositely.
LIFT_ROTORS = (
    ("front_port", (1.1, -4.0, 2.10), 1),
    ("rear_port", (6.1, -4.0, 2.79), -1),
    ("front_starboard", (1.1, 4.0, 2.10), -1),
    ("rear_starboard", (6.1, 4.0, 2.79), 1),
)
ROTOR = """[[rotors]]
name = "{name}"
kind = "lift"
hub_m = {hub}
spin = {spin}
radius_m = 2.1                          # nearly the disk area of the eight
root_cutout = 0.2
blades = 2
chord_m = [0.41, 0.14]
twist_deg = [30.0, 23.333333, 16.666667, 10.0]
speed_rpm = 870.0                       # the same tip speed

"""
EDITS = {
    'name = "NASA Lift+Cruise"': 'name = "Four rotors"',
    "lift_bore_m = 0.17": "lift_bore_m = 0.22",
    "area_m2 = 0.836": "area_m2 = 0.780",  # half as many hubs and stopped rotors: of their 0.1115 m^2 in the drag build-up
    "area_m2 = 0.1115": "area_m2 = 0.0558",
    "lift_rotor_radius_m = { lower = 1.2, upper = 1.8": "lift_rotor_radius_m = { lower = 1.8, upper = 2.5",
}


def four_rotors() -> str:
    """The shipped vehicle file with these rotors."""
    text = resources.files("lpc_mdo.data").joinpath("vehicle.toml").read_text(encoding="utf-8")
    head, *rotors = re.split(r"(?m)^(?=\[\[rotors\]\])", text)
    ours = "".join(ROTOR.format(name=name, hub=list(hub), spin=spin) for name, hub, spin in LIFT_ROTORS)
    text = head + ours + rotors[-1]
    for old, new in EDITS.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "vehicle.toml"
    file.write_text(four_rotors(), encoding="utf-8")
    vehicle, mission = lpc_mdo.load(file)
problem = lpc_mdo.gross_weight_problem(vehicle, mission)
with torch.no_grad():
    analysis = problem.analyze(problem.x0)

if __name__ == "__main__":
    print(f"{problem.size} design variables, {len(problem.constraints)} constraints")
    print(f"gross mass at the start {float(analysis.gross_mass):.0f} kg")
    Path("four_rotors.toml").write_text(four_rotors(), encoding="utf-8")
    print("on the command line: lpc-mdo optimize four_rotors.toml --output runs/four_rotors")
