"""Level around the aircraft in a vertical plane, one line a model."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Directivity in hover"
CAPTION = (
    "Level at one distance around the aircraft in its plane of symmetry: up is above, left ahead. Steady loads are silent along the "
    "rotors' axis, varying ones are not."
)
SPAN = 50.0  # dB shown below the loudest
NEEDS = ("directivity",)


def draw(run: StoredRun) -> Figure:
    stored = run.optimized["noise"]["directivity"]
    return plot(stored["polar_rad"], stored["levels_dba"], stored["distance_m"])


def plot(polar: ArrayLike, levels: Mapping[str, ArrayLike], distance: float, unit: str = "dB(A)") -> Figure:
    """polar (angle,) rad from straight up, over ahead; levels by name, each (angle,), in `unit`; distance m."""
    figure = style.figure(5.0)
    axes = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")  # type: ignore[attr-defined]
    loudest = 5.0 * np.ceil(max(float(np.max(np.asarray(level))) for level in levels.values()) / 5.0)
    for (name, level), color in zip(levels.items(), style.CYCLE, strict=False):
        axes.plot(polar, np.maximum(np.asarray(level), loudest - SPAN), color=color, label=name)
    axes.set_ylim(loudest - SPAN, loudest)
    axes.set_yticks(np.arange(loudest - SPAN + 10.0, loudest + 1.0, 10.0))
    axes.set_rlabel_position(200.0)  # type: ignore[attr-defined]
    axes.set_xticks(np.radians([0, 45, 90, 135, 180, 225, 270, 315]))
    axes.set_xticklabels(["above", "", "ahead", "", "below", "", "aft", ""])
    axes.tick_params(axis="x", pad=9.0)
    axes.set_title(f"{TITLE}, {unit} at {distance:g} m", pad=12.0)
    figure.legend(loc="outside lower center", ncols=2)
    return figure
