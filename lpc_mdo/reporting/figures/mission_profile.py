"""Altitude over time along the flown mission."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
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
        start, last = end, high
    for legs in _together(run.optimized["mission"], 0.04 * 60.0 * start):
        _name(axes, legs)
    axes.set(xlabel="time, min", ylabel="altitude, m", title=TITLE, xlim=(0.0, start))
    axes.set_ylim(0.0, 1.32 * axes.get_ylim()[1])
    return figure


def _together(mission: list[dict[str, Any]], short: float) -> list[list[dict[str, Any]]]:
    """Legs with the time in s at which they begin; those on lift rotors one after another, each shorter than `short` s, as one."""
    found: list[list[dict[str, Any]]] = []
    begin = 0.0
    for leg in mission:
        leg = leg | {"begin_s": begin}
        begin += leg["duration_s"]
        leg["is_short"] = not leg["is_wingborne"] and leg["duration_s"] < short
        if leg["is_short"] and found and found[-1][-1]["is_short"]:
            found[-1].append(leg)
        else:
            found.append([leg])
    return found


def _name(axes: Axes, legs: list[dict[str, Any]]) -> None:
    """Names, distance and power beside a line."""
    first, last = legs[0], legs[-1]
    start, end = first["begin_s"] / 60.0, (last["begin_s"] + last["duration_s"]) / 60.0
    low, high = last["altitude_m"]
    names = ", ".join(wording.words(leg["name"]) for leg in legs)
    power = ", ".join(f"{leg['power_W'] / 1e3:.0f}" for leg in legs)
    look = {"textcoords": "offset points", "fontsize": 7.5}
    if not first["is_wingborne"]:
        axes.annotate(f"{names}\n{power} kW", (end, low), xytext=(9, -5), va="bottom", **look)
    elif low != high:
        # On the side where the line leaves room.
        middle, aside = (0.5 * (start + end), 0.5 * (low + high)), -7 if high < low else 7
        axes.annotate(
            f"{names}\n{power} kW", middle, xytext=(aside, 0), va="center", ha="right" if aside < 0 else "left", **look
        )
    else:
        route = f"{first['distance_m'] / 1e3:.0f} km at {first['speed_m_per_s']:.0f} m/s"
        where = (0.5 * (start + end), high)
        axes.annotate(f"{names}\n{route}\n{power} kW", where, xytext=(0, 6), ha="center", va="bottom", **look)
