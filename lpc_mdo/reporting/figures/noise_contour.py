"""Contours of level on the ground, seen from above."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Noise on the ground"
CAPTION = "Levels on level ground without its reflection, which a hard surface raises by up to 6 dB."
STEPS = (1.0, 2.0, 5.0, 10.0)  # dB between contours: the first that leaves at most twelve
NEEDS = ("contour",)


def draw(run: StoredRun) -> Figure:
    stored = run.optimized["noise"]["contour"]
    return plot(stored["ahead_m"], stored["starboard_m"], stored["level_dba"], stored["what"])


def plot(ahead: ArrayLike, starboard: ArrayLike, level: ArrayLike, what: str, unit: str = "dB(A)") -> Figure:
    """ahead (x,) m and starboard (y,) m of the middle; level (x, y) in `unit`; `what` is shown, e.g. a hover at 76 m."""
    x, y, z = np.asarray(ahead), np.asarray(starboard), np.asarray(level)
    reach = float(np.ptp(y) / np.ptp(x))
    figure = style.figure(min(7.0, 1.3 + 5.6 * reach), 7.2)
    axes = figure.add_subplot()
    step = next((s for s in STEPS if np.ptp(z) / s <= 12.0), STEPS[-1])
    steps = np.arange(step * np.floor(z.min() / step), z.max() + step, step)
    areas = axes.contourf(x, y, z.T, steps, cmap="cividis")
    lines = axes.contour(x, y, z.T, steps, colors=style.SURFACE, linewidths=0.7)
    axes.clabel(lines, fmt="%g", fontsize=7)
    axes.plot(0.0, 0.0, marker="x", color=style.ORANGE, markersize=7)
    axes.set(xlabel="ahead, m", ylabel="starboard, m", title=f"{TITLE}: {what}", aspect="equal")
    axes.grid(False)
    figure.colorbar(areas, ax=axes, label=f"level, {unit}", shrink=0.85)
    return figure
