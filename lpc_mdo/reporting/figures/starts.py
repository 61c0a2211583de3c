"""Where scattered starts end, and the way there."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from lpc_mdo.reporting import style, wording

SMALLEST = 1e-7  # of the objective: what a certificate no longer resolves


def draw(content: dict[str, Any], histories: Sequence[Sequence[dict[str, str]]], objective: dict[str, str]) -> Figure:
    """content: starts.json; histories: rows of every start's history.csv, in its order; objective: name and unit."""
    figure = style.figure(3.4)
    ends, ways = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
    _ends(ends, content, objective)
    _ways(ways, content, histories, objective)
    return figure


def _title(objective: dict[str, str]) -> str:
    return wording.words(objective["name"]) + ("" if objective["unit"] == "1" else f", {objective['unit']}")


def _ends(axes: Axes, content: dict[str, Any], objective: dict[str, str]) -> None:
    known = sorted((row for row in content["starts"] if row["objective"] is not None), key=lambda row: row["objective"])
    groups = {
        "converged": ([(i, r["objective"]) for i, r in enumerate(known, 1) if r["optimum"]], "o", style.AFTER),
        "not converged": ([(i, r["objective"]) for i, r in enumerate(known, 1) if not r["optimum"]], "x", style.ORANGE),
    }
    for label, (points, marker, color) in groups.items():
        if points:
            axes.plot(*zip(*points, strict=True), marker, color=color, markersize=4, label=f"{label}: {len(points)}")
    if content["optima"]:
        best = content["optima"][0]["objective"]
        edge = best + content["near"] * abs(best)
        axes.axhspan(best, edge, color=style.tint(style.GREEN), zorder=0, label=f"within {content['near']:.1%} of best")
        worst = max(row["objective"] for row in known if row["optimum"])
        room = max(worst - best, 1.5 * (edge - best))
        low, high = best - 0.15 * room, best + 1.6 * room
        axes.set_ylim(low, high)
        hidden = sum(not low <= row["objective"] <= high for row in known)
        if hidden:  # not feasible, hence anywhere
            axes.annotate(
                f"{hidden} not converged, outside", (0.98, 0.03), xycoords="axes fraction", ha="right", fontsize=8
            )
    axes.legend(loc="upper left", fontsize=8)
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="start, by where it ends", ylabel=_title(objective), title="Where the starts end")


def _ways(
    axes: Axes, content: dict[str, Any], histories: Sequence[Sequence[dict[str, str]]], objective: dict[str, str]
) -> None:
    column = f"{objective['name']}_{objective['unit']}"
    best = content["optima"][0]["objective"] if content["optima"] else 0.0
    size = abs(best) or 1.0
    for row, history in zip(content["starts"], histories, strict=True):
        points = [
            (int(record["evaluations"]), max(abs(float(record[column]) - best) / size, SMALLEST)) for record in history
        ]
        if points:
            color = style.AFTER if row["optimum"] else style.ORANGE
            axes.semilogy(*zip(*points, strict=True), "-", color=color, linewidth=0.9, alpha=0.6)
            axes.semilogy(*points[-1], "o", color=color, markersize=3)
    axes.axhline(content["near"], color=style.GREEN, linestyle="--", linewidth=0.9)
    axes.set(
        xlabel="evaluation, batches included",
        ylabel=f"distance from best {wording.words(objective['name'])}, –",
        title="The ways there",
    )
