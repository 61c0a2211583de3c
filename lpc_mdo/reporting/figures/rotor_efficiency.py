"""Figure of merit of the lift rotors and propulsive efficiency of the pusher, before and after."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Rotor efficiencies"
CAPTION = (
    "Figure of merit of every lift rotor in hover and, where it is part of the problem, propulsive efficiency of the "
    "pusher in climb and cruise; arrows lead from the initial to the optimized rotor."
)
NEEDS = ("operating_points",)


def draw(run: StoredRun) -> Figure:
    before, after = run.initial["operating_points"], run.optimized["operating_points"]
    figure = style.figure(0.3 * len(after) + 0.9)
    axes = figure.subplots()
    for i, (old, new) in enumerate(zip(before, after, strict=True)):
        axes.annotate(
            "",
            (new["efficiency"], i),
            (old["efficiency"], i),
            arrowprops={"arrowstyle": "->", "color": style.MUTED, "linewidth": 1.0, "shrinkA": 3, "shrinkB": 3},
        )
        is_right = new["efficiency"] >= old["efficiency"]
        axes.annotate(
            f"{new['efficiency']:.3f}",
            (new["efficiency"], i),
            xytext=(8 if is_right else -8, 0),
            textcoords="offset points",
            ha="left" if is_right else "right",
            va="center",
            fontsize=8,
            color=style.AFTER,
        )
    rows = range(len(after))
    axes.plot([point["efficiency"] for point in before], rows, "o", color=style.BEFORE, label="initial")
    axes.plot([point["efficiency"] for point in after], rows, "o", color=style.AFTER, label="optimized")
    axes.set_yticks(rows, [f"{wording.words(point['rotor'])}, {point['segment']}" for point in after])
    axes.invert_yaxis()
    axes.set(xlabel="figure of merit (hover), propulsive efficiency (climb, cruise), –", title=TITLE)
    axes.margins(x=0.15)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure
