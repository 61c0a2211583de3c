"""Chord and twist along the blades, before and after."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun, own_rotors

TITLE = "Blade shapes"
CAPTION = (
    "Chord and twist of one rotor of each mirrored pair of lift rotors and, where it is part of the problem, of the "
    "pusher; r/R is the radius over the tip radius, of which the title gives the optimized value."
)
NEEDS = ("rotors",)


def draw(run: StoredRun) -> Figure:
    pairs = list(zip(own_rotors(run.initial["rotors"]), own_rotors(run.optimized["rotors"]), strict=True))
    figure, grid = style.panels(2, len(pairs), 1.5, sharex=True)
    for column, designs in enumerate(pairs):
        for rotor, color, label in zip(designs, (style.BEFORE, style.AFTER), ("initial", "optimized"), strict=True):
            r = np.array(rotor["station_m"]) / rotor["radius_m"]
            grid[0, column].plot(r, np.array(rotor["chord_m"]), color=color, label=label)
            grid[1, column].plot(r, np.degrees(rotor["twist_rad"]), color=color)
        grid[0, column].set_title(_name(designs[1]), fontsize=8)
        grid[1, column].set_xlabel("r/R")
        grid[1, column].set(xlim=(0.2, 1.0), xticks=(0.2, 0.6, 1.0))
    _share_scale(grid)
    grid[0, 0].set_ylabel("chord, m")
    grid[1, 0].set_ylabel("twist, °")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="center", bbox_to_anchor=(0.5, 0.515), ncols=2)
    return figure


def _name(rotor: dict[str, Any]) -> str:
    return f"{wording.words(rotor['name'].removesuffix('_port'))}\nR = {rotor['radius_m']:.2f} m"


def _share_scale(grid: Any) -> None:
    """One scale a row, so that rotors compare at a glance."""
    for row in grid:
        top = max(axes.get_ylim()[1] for axes in row)
        for axes in row:
            axes.set_ylim(0.0, top)
        for axes in row[1:]:
            axes.tick_params(labelleft=False)
