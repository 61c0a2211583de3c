"""Altitude over time along the flown mission."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Mission profile"
CAPTION = (
    "Altitude along the flights and the reserve of the optimized aircraft. Where dotted lines join the end of one segment to the "
    "start of the next, nothing is flown between them in this mission."
)
NEEDS = ("mission",)


def draw(run: StoredRun) -> Figure:
    figure = style.figure(2.7)
    axes = figure.subplots()
    start, last = 0.0, None
    for segment in run.optimized["mission"]:
        end = start + segment["duration_s"] / 60.0
        low, high = segment["altitude_m"]
        if last is not None and last != low:
            axes.plot([start, start], [last, low], color=style.MUTED, linestyle=":", linewidth=1.0)
        is_reserve = segment["name"] == "reserve"
        axes.plot([start, end], [low, high], color=style.ORANGE if is_reserve else style.AFTER, linewidth=2.2)
        _name(axes, segment, start, end)
        start, last = end, high
    axes.set(xlabel="time, min", ylabel="altitude, m", title=TITLE, xlim=(0.0, start))
    axes.set_ylim(0.0, 1.32 * axes.get_ylim()[1])
    return figure


def _name(axes: Axes, segment: dict[str, Any], start: float, end: float) -> None:
    """Name, distance and power of a segment beside its line."""
    low, high = segment["altitude_m"]
    text = f"{segment['name']}\n{segment['power_W'] / 1e3:.0f} kW"
    look = {"textcoords": "offset points", "fontsize": 7.5}
    if segment["kind"] in ("hover", "vertical_climb"):
        axes.annotate(text, (end, low), xytext=(9, -5), va="bottom", **look)
    elif segment["kind"] in ("climb", "descent"):
        axes.annotate(text, (0.5 * (start + end), 0.5 * (low + high)), xytext=(7, 0), va="center", **look)
    else:
        route = f"{segment['distance_m'] / 1e3:.0f} km at {segment['speed_m_per_s']:.0f} m/s"
        text = text.replace("\n", f"\n{route}\n")
        axes.annotate(text, (0.5 * (start + end), high), xytext=(0, 6), ha="center", va="bottom", **look)
