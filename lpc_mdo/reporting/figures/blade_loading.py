"""Angle of attack, lift coefficient and thrust along the blades, before and after."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Blade loading"
CAPTION = (
    "Angle of attack, lift coefficient and thrust of all blades together for each metre of radius: one lift rotor of each "
    "mirrored pair in hover and, where it is part of the problem, the pusher in climb and cruise. Blue: optimized, grey: "
    "initial."
)
NEEDS = ("operating_points",)
ROWS = (
    ("angle_of_attack_rad", "angle of\nattack, °", 180.0 / np.pi),
    ("lift_coefficient", "lift\ncoefficient, –", 1.0),
    ("thrust_per_length_N_per_m", "thrust,\nkN/m", 1e-3),
)


def draw(run: StoredRun) -> Figure:
    pairs = [
        (before, after)
        for before, after in zip(run.initial["operating_points"], run.optimized["operating_points"], strict=True)
        if "starboard" not in after["rotor"]
    ]
    figure, grid = style.panels(len(ROWS), len(pairs), 1.35, sharex=True, sharey="row")
    figure.subplots_adjust(left=0.11)
    radii = {
        name: {rotor["name"]: np.array(rotor["station_m"]) / rotor["radius_m"] for rotor in design["rotors"]}
        for name, design in run.analysis["designs"].items()
    }
    for column, (before, after) in enumerate(pairs):
        for row, (key, _, scale) in enumerate(ROWS):
            for point, design, color in ((before, "initial", style.BEFORE), (after, "optimized", style.AFTER)):
                grid[row, column].plot(radii[design][point["rotor"]], scale * np.array(point[key]), color=color)
        grid[0, column].set_title(_name(after), fontsize=8)
        grid[-1, column].set(xlabel="r/R", xlim=(0.2, 1.0), xticks=(0.4, 0.8))
    for row, (_, label, _) in enumerate(ROWS):
        grid[row, 0].set_ylabel(label)
    return figure


def _name(point: dict[str, Any]) -> str:
    return f"{wording.words(point['rotor'].removesuffix('_port'))}\n{point['segment']}"
