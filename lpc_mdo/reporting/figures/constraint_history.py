"""Every inequality of the problem over the evaluations, with its limit, and the trim residual."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Constraint histories"
CAPTION = (
    "The component of each row that is nearest to or farthest beyond its limit, at every design that the search "
    "evaluated; of the trim equations their norm. Shaded: infeasible. Line searches show as spikes."
)
NEEDS = ("evaluations",)
COLUMNS = 3


def draw(run: StoredRun) -> Figure:
    rows = [row for row in run.result["constraints"] if row["kind"] == "inequality" or row["name"] == "trim_residual"]
    columns = min(COLUMNS, len(rows))
    lines = -(-len(rows) // columns)
    figure, panels = style.panels(lines, columns, 1.5, sharex=True)
    grid = panels.flatten()
    numbers = [int(record["evaluation"]) for record in run.evaluations]
    for axes, row in zip(grid, rows, strict=False):
        axes.plot(numbers, [float(record[row["name"]]) for record in run.evaluations], color=style.AFTER, linewidth=1.1)
        unit = "" if row["unit"] == "1" else f", {row['unit']}"
        axes.set_title(wording.words(row["name"]) + unit, fontsize=8)
        if row["kind"] == "equality":
            axes.set_yscale("log")
        else:
            _limits(axes, row)
    for axes in grid[len(rows) :]:
        axes.set_visible(False)
    for axes in grid[max(0, len(rows) - columns) : len(rows)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel("design evaluated", fontsize=9, y=0.0, va="bottom")
    return figure


def _limits(axes: Axes, row: dict[str, Any]) -> None:
    low, high = axes.get_ylim()
    for limit, side in ((row["lower"], -1), (row["upper"], 1)):
        if limit is None:
            continue
        low, high = min(low, limit - 0.06 * (high - low)), max(high, limit + 0.06 * (high - low))
        axes.axhline(limit, color=style.ORANGE, linewidth=1.0)
        axes.axhspan(limit, high if side > 0 else low, color=style.ORANGE, alpha=0.12, linewidth=0.0)
        axes.annotate(
            f"limit {limit:.4g}",
            (1.0, limit),
            xycoords=("axes fraction", "data"),
            xytext=(-2, 2 * side),
            textcoords="offset points",
            fontsize=7,
            ha="right",
            va="bottom" if side > 0 else "top",
            color=style.ORANGE,
            bbox={"facecolor": style.SURFACE, "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
        )
    axes.set_ylim(low, high)
