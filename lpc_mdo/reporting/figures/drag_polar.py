"""Drag polar in cruise with the cruise point."""

import numpy as np
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Drag polar in cruise"
CAPTION = (
    "Lift over drag coefficient of the whole aircraft, each on its own wing area, tail as in cruise; dots: the cruise "
    "points, that of the initial aircraft not trimmed. Dashed: lines of equal lift-to-drag ratio."
)
NEEDS = ("polar",)
RATIOS = (8.0, 10.0, 12.0, 14.0, 16.0)


def draw(run: StoredRun) -> Figure:
    figure = style.figure(3.4)
    axes = figure.subplots()
    top = 0.0
    plan = (("initial", run.initial, style.BEFORE, "right"), ("optimized", run.optimized, style.AFTER, "left"))
    for name, design, color, side in plan:
        polar = design["polar"]
        lift, drag = np.array(polar["lift_coefficient"]), np.array(polar["drag_coefficient"])
        below_stall = lift <= polar["maximum_lift_coefficient"]
        lift, drag = lift[below_stall], drag[below_stall]
        point = polar["cruise"]
        ratio = point["lift_coefficient"] / point["drag_coefficient"]
        axes.plot(drag, lift, color=color)
        axes.plot(point["drag_coefficient"], point["lift_coefficient"], "o", color=color)
        axes.annotate(
            f"{name}: L/D {ratio:.1f}",
            (point["drag_coefficient"], point["lift_coefficient"]),
            xytext=(9, -9) if side == "left" else (-9, 6),
            ha=side,
            textcoords="offset points",
            color=color,
            bbox={"facecolor": style.SURFACE, "edgecolor": "none", "pad": 1.0},
        )
        top = max(top, lift.max())
    right = axes.get_xlim()[1]
    for ratio in RATIOS:
        end = min(right, 0.97 * top / ratio)
        axes.plot([0.0, end], [0.0, ratio * end], color=style.MUTED, linewidth=0.7, linestyle=(0, (4, 3)))
        axes.text(end, ratio * end, f"{ratio:.0f}", fontsize=7.5, color=style.MUTED, ha="left", va="bottom")
    axes.set(
        xlabel="drag coefficient, –", ylabel="lift coefficient, –", title=TITLE, xlim=(0.0, right), ylim=(0.0, None)
    )
    return figure
