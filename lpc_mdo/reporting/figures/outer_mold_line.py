"""The outer mold line with the camber meshes of wing and tail, in four views."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun
from lpc_mdo.reporting.views import FRONT, OBLIQUE, SIDE, TOP, bodies, hull, mesh_lines, shade, true_to_scale

TITLE = "Outer mold line with camber meshes"
CAPTION = (
    "The optimized aircraft, and on it the camber surfaces that the vortex lattice works on: half way between the upper and "
    "the lower side, found by projection. All views are true to scale."
)
NEEDS = ("mold",)
HEIGHT = 4.6


def draw(run: StoredRun) -> Figure:
    return plot(run.optimized["mold"])


def plot(mold: dict[str, Any]) -> Figure:
    """Four views of a shape as `lpc_mdo.reporting.mold` stores it."""
    figure = style.figure(HEIGHT)
    grid = figure.add_gridspec(2, 2, height_ratios=(2.0, 1.0))
    views = {"From ahead, port and above": OBLIQUE, "From above": TOP, "From ahead": FRONT, "From port": SIDE}
    covered = bodies(mold)
    for cell, (title, view) in zip(grid, views.items(), strict=True):
        axes = figure.add_subplot(cell)
        shade(axes, view, covered)
        for rim in mold["disks"].values():
            hull(axes, view, np.asarray(rim), style.GREEN, 0.6, fill=0.12)
        mesh_lines(axes, view, mold["wing_mesh"], style.BLUE)
        mesh_lines(axes, view, mold["tail_mesh"], style.ORANGE)
        true_to_scale(axes, title)
    names = {"wing": style.BLUE, "horizontal tail": style.ORANGE, "rotor disks": style.GREEN}
    lines = [Line2D([], [], color=color, linewidth=1.4) for color in names.values()]
    figure.legend(lines, list(names), loc="outside lower center", ncols=3)
    return figure
