"""Prediction of the structural surrogate against the sized samples, as the published study shows its own."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Structural surrogate against its samples"
CAPTION = (
    "Wing, booms and fuselage together: mass and centre of gravity of sized structures and as the surrogate from our own "
    "sizing predicts them, above; their difference, below. The samples behind the published regressions are not public; the "
    "provenance below names the surrogate that this run used."
)
NEEDS = ("surrogate_samples",)
HEIGHT = 5.0
LOOKS = ((style.BEFORE, "o", 9), (style.GOLD, "s", 8), (style.BLUE, "^", 12))  # colour, marker, size by set
PANELS = (("mass_kg", "mass", "kg", "kg", 1.0), ("center_of_gravity_m", "centre of gravity, x", "m", "mm", 1e3))


def draw(run: StoredRun) -> Figure:
    return plot(run.analysis["surrogate_samples"])


def plot(sets: Sequence[dict[str, Any]]) -> Figure:
    """Sets of samples as `lpc_mdo.reporting.surrogate_samples.sample_data` has them."""
    figure = style.figure(HEIGHT)
    grid = figure.subplots(2, 2, sharex="col", height_ratios=(2.0, 1.0))
    for column, (key, title, unit, fine, factor) in enumerate(PANELS):
        top, bottom = grid[:, column]
        for part, (color, marker, size) in zip(sets, LOOKS, strict=False):
            x, y = (np.asarray(part[kind][key]) for kind in ("sized", "predicted"))
            look = {"s": size, "color": color, "marker": marker, "linewidths": 0.0, "alpha": 0.85}
            top.scatter(x, y, label=part["name"], **look)
            bottom.scatter(x, (y - x) * factor, **look)
        ends = top.get_xlim()
        top.plot(ends, ends, color=style.INK, linewidth=0.8, zorder=0)
        bottom.axhline(0.0, color=style.INK, linewidth=0.8, zorder=0)
        top.set(title=title.capitalize(), ylabel=f"surrogate, {unit}", xlim=ends, ylim=ends)
        bottom.set(xlabel=f"sized sample, {unit}", ylabel=f"difference, {fine}")
    grid[0, 0].legend(markerscale=1.5)
    return figure
