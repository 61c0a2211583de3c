"""Efficiency of a motor over speed and torque, with its limits and operating points."""

from collections.abc import Mapping

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Motor efficiency"
CAPTION = (
    "Efficiency from shaft to terminals within the current and voltage limits (thick line); marks: operating points."
)
LEVELS = (0.6, 0.7, 0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98)
NEEDS = ("motor_map",)


def draw(run: StoredRun) -> Figure:
    stored = run.optimized["motor_map"]
    return plot(
        stored["speed_rad_per_s"],
        stored["torque_N_m"],
        np.array(stored["efficiency"], dtype=float),  # null, where the motor cannot go, becomes NaN
        stored["limit_N_m"],
        stored["points"],
        stored["name"],
    )


def plot(
    speed: ArrayLike,
    torque: ArrayLike,
    efficiency: ArrayLike,
    limit: ArrayLike,
    points: Mapping[str, tuple[float, float]],
    name: str,
) -> Figure:
    """speed (speed,) rad/s, torque (torque,) N m, efficiency (torque, speed), NaN outside; limit (speed,) N m.

    points: speed and torque by name of what the motor does there.
    """
    n, t, eta = np.asarray(speed) * 30.0 / np.pi, np.asarray(torque), np.asarray(efficiency)
    figure = style.figure(4.0)
    axes = figure.add_subplot()
    colors = matplotlib.colormaps["cividis"]
    areas = axes.contourf(
        n, t, eta, LEVELS, cmap=colors, norm=BoundaryNorm(LEVELS, colors.N, extend="both"), extend="both"
    )
    lines = axes.contour(n, t, eta, LEVELS, colors=style.SURFACE, linewidths=0.6)
    axes.clabel(lines, fmt=lambda value: f"{100 * value:g}", fontsize=7)
    axes.plot(n, limit, color=style.INK, linewidth=2.0)
    for what, (at_speed, at_torque) in points.items():
        axes.plot(
            at_speed * 30.0 / np.pi, at_torque, "o", color=style.ORANGE, markeredgecolor=style.SURFACE, markersize=7
        )
        axes.annotate(
            what, (at_speed * 30.0 / np.pi, at_torque), xytext=(7, 5), textcoords="offset points", fontsize=8,
            bbox={"facecolor": style.SURFACE, "edgecolor": "none", "alpha": 0.8, "pad": 1.5},
        )  # fmt: skip
    top = max(float(np.nanmax(np.asarray(limit))), *(at[1] for at in points.values()), 0.0)
    axes.set(
        xlim=(n[0], n[-1]),
        ylim=(0.0, 1.1 * top),
        xlabel="speed, rev/min",
        ylabel="torque, N m",
        title=f"{TITLE}: {name}",
    )
    axes.grid(False)
    figure.colorbar(areas, ax=axes, label="efficiency, %", ticks=LEVELS, format=lambda value, _: f"{100 * value:g}")
    return figure
