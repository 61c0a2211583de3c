"""Angle of attack, lift coefficient and thrust along the blades, before and after."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun, own_rotors

TITLE = "Blade loading"
CAPTION = (
    "Angle of attack, lift coefficient and thrust of all blades together for each metre of radius: one rotor of each mirrored pair, "
    "a line for each segment where it turns. Blue: optimized, grey: initial."
)
NEEDS = ("operating_points",)
ROWS = (
    ("angle_of_attack_rad", "angle of\nattack, °", 180.0 / np.pi),
    ("lift_coefficient", "lift\ncoefficient, –", 1.0),
    ("thrust_per_length_N_per_m", "thrust,\nkN/m", 1e-3),
)


STYLES = ("solid", "dashed", "dotted", "dashdot", (0, (1, 3)), (0, (6, 1, 1, 1, 1, 1)))


def draw(run: StoredRun) -> Figure:
    """One column a rotor, one line a segment where it turns."""
    rotors = [rotor["name"] for rotor in own_rotors(run.optimized["rotors"])]
    points = run.optimized["operating_points"]
    lines = {point["segment"]: STYLES[_place(points, point["segment"]) % len(STYLES)] for point in points}
    figure, grid = style.panels(len(ROWS), len(rotors), 1.35, sharex=True, sharey="row")
    figure.subplots_adjust(left=0.11)
    for name, color in (("initial", style.BEFORE), ("optimized", style.AFTER)):
        design = run.analysis["designs"][name]
        radii = {rotor["name"]: np.array(rotor["station_m"]) / rotor["radius_m"] for rotor in design["rotors"]}
        for point in design["operating_points"]:
            if point["rotor"] not in rotors:
                continue
            for row, (key, _, scale) in enumerate(ROWS):
                grid[row, rotors.index(point["rotor"])].plot(
                    radii[point["rotor"]],
                    scale * np.array(point[key]),
                    color=color,
                    linestyle=lines[point["segment"]],
                    linewidth=1.4,
                )
    for column, rotor in enumerate(rotors):
        turning = [p["segment"] for p in run.optimized["operating_points"] if p["rotor"] == rotor]
        title = wording.words(rotor.removesuffix("_port"))
        grid[0, column].set_title(title + (f"\n{turning[0]}" if len(turning) == 1 else ""), fontsize=8)
        grid[-1, column].set(xlabel="r/R", xlim=(0.2, 1.0), xticks=(0.4, 0.8))
        if len(turning) > 1:
            keys = [Line2D([], [], color=style.AFTER, linestyle=lines[s], label=wording.words(s)) for s in turning]
            # The lowest row is empty towards the root, where there is little thrust.
            grid[-1, column].legend(handles=keys, loc="upper left", fontsize=5.5, frameon=False, borderpad=0.0)
    for row, (_, label, _) in enumerate(ROWS):
        grid[row, 0].set_ylabel(label)
    return figure


def _place(points: list[dict[str, Any]], segment: str) -> int:
    """Among the segments of the rotor that turns there."""
    rotor = next(point["rotor"] for point in points if point["segment"] == segment)
    return [point["segment"] for point in points if point["rotor"] == rotor].index(segment)
