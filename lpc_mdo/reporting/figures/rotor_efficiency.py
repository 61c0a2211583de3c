"""Figure of merit of the lift rotors and propulsive efficiency of the pusher, before and after."""

import numpy as np
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun, own_rotors

TITLE = "Rotor efficiencies"
CAPTION = (
    "Figure of merit of every lift rotor and, where it is part of the problem, propulsive efficiency of the pusher, in each segment "
    "where it turns; arrows lead from the initial to the optimized rotor."
)
NEEDS = ("operating_points",)
MANY = 12  # points, beyond which one rotor of each mirrored pair stands for both


def draw(run: StoredRun) -> Figure:
    before, after = run.initial["operating_points"], run.optimized["operating_points"]
    if len(after) > MANY:
        own = {rotor["name"] for rotor in own_rotors(run.optimized["rotors"])}
        before, after = ([point for point in points if point["rotor"] in own] for points in (before, after))
    figure = style.figure(0.3 * len(after) + 0.9)
    axes = figure.subplots()
    # Null, where the rotor descends, gives no thrust or takes no power, becomes NaN, which is not drawn.
    initial, optimized = (np.array([p["efficiency"] for p in points], dtype=float) for points in (before, after))
    for i, (old, new) in enumerate(zip(initial, optimized, strict=True)):
        if not np.isfinite(old + new):
            continue
        axes.annotate(
            "",
            (new, i),
            (old, i),
            arrowprops={"arrowstyle": "->", "color": style.MUTED, "linewidth": 1.0, "shrinkA": 3, "shrinkB": 3},
        )
        axes.annotate(
            f"{new:.3f}",
            (new, i),
            xytext=(8 if new >= old else -8, 0),
            textcoords="offset points",
            ha="left" if new >= old else "right",
            va="center",
            fontsize=8,
            color=style.AFTER,
        )
    rows = range(len(after))
    axes.plot(initial, rows, "o", color=style.BEFORE, label="initial")
    axes.plot(optimized, rows, "o", color=style.AFTER, label="optimized")
    axes.set_yticks(rows, [f"{wording.words(point['rotor'])}, {wording.words(point['segment'])}" for point in after])
    axes.invert_yaxis()
    axes.set(xlabel="figure of merit of lift rotors, propulsive efficiency of pushers, –", title=TITLE)
    axes.margins(x=0.15)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure
