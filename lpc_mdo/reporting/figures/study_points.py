"""The points of a study: a front with its slopes, or a sweep."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredStudy

TITLE = "Points of the study"
CAPTION = (
    "Every point is an optimization of its own; the line joins those with a certificate, of a front those that no other "
    "dominates. Short lines: slopes by the envelope theorem, from the multipliers of a single optimization. What the "
    "published study says of its own front, where it says something, is grey."
)
PUBLISHED_ENDS = {"noise-efficiency": ((0.64, 81.0), (0.78, 91.0))}
PUBLISHED_CHANGE = {"weight-speed": (0.11, 0.15)}  # relative, from the slowest aircraft
SAME = 1e-6  # relative difference of positions that are one on the page
TANGENT = 0.06  # of the axes' width, to either side


def is_drawable(study: StoredStudy) -> bool:
    return bool(study.results)


def draw(study: StoredStudy) -> Figure:
    content = study.content
    points = [point for point in content["points"] if point["position"]]
    is_front = content["kind"] == "pareto"
    good = [point for point in points if (point["is_on_front"] if is_front else point["status"] == "converged")]
    good.sort(key=lambda point: point["position"][0])
    figure = style.figure(3.8)
    axes = figure.subplots()
    positions = zip(*[point["position"] for point in good], strict=True)
    axes.plot(*positions, "o-", color=style.AFTER, markersize=5, label="certified optima")
    if study.beside:
        _beside(axes, study.beside)
    other = [point for point in points if point not in good]
    if other:
        axes.plot(
            *zip(*[point["position"] for point in other], strict=True), "x", color=style.ORANGE, label=_left_out(other)
        )
    if content.get("is_published_case", False):
        _published(axes, content["name"], good)
    _tangents(axes, good)
    axes.legend()
    # On the side of the line that a falling one leaves free.
    is_falling = len(good) > 1 and good[0]["position"][1] > good[-1]["position"][1]
    apart = _apart(good)
    for point in apart[:: max(1, len(apart) // 4)]:
        axes.annotate(
            f"{point['value']:.4g}",
            point["position"],
            xytext=(5 if is_falling else -5, 6),
            textcoords="offset points",
            ha="left" if is_falling else "right",
            fontsize=7.5,
        )
    horizontal, vertical = (_label(axis) for axis in content["axes"])
    axes.set(
        xlabel=horizontal, ylabel=vertical, title=f"{content['name'].capitalize()}, numbers: {_parameter(content)}"
    )
    axes.margins(x=0.1, y=0.1)
    return figure


def _published(axes: Axes, name: str, points: list[dict[str, Any]]) -> None:
    marks = list(PUBLISHED_ENDS.get(name, ()))
    if name in PUBLISHED_CHANGE and points:
        (x, y), (faster, heavier) = points[0]["position"], PUBLISHED_CHANGE[name]
        marks.append((x * (1.0 + faster), y * (1.0 + heavier)))
        axes.plot([x, marks[-1][0]], [y, marks[-1][1]], "--", color=style.MUTED, linewidth=1.0)
    for mark in marks:
        axes.plot(*mark, "s", color=style.MUTED, markersize=5)
        axes.annotate("published", mark, xytext=(6, -3), textcoords="offset points", color=style.MUTED, fontsize=8)


def _apart(points: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Of points in a row that lie in one place, the first."""
    kept: list[dict[str, Any]] = []
    for point in points:
        if not kept or not np.allclose(point["position"], kept[-1]["position"], rtol=SAME, atol=0.0):
            kept.append(point)
    return kept


def _beside(axes: Axes, study: StoredStudy) -> None:
    """The same front by least speeds, where this one is by weighted sums."""
    points = sorted(point["position"] for point in study.content["points"] if point["is_on_front"])
    if points:
        axes.plot(
            *zip(*points, strict=True), "s--", color=style.GREEN, markersize=4, label="least weight at fixed speeds"
        )


def _left_out(points: list[dict[str, Any]]) -> str:
    states = {"dominated" if point["status"] == "converged" else wording.words(point["status"]) for point in points}
    return ", ".join(sorted(states))


def _tangents(axes: Axes, points: list[dict[str, Any]]) -> None:
    low, high = axes.get_xlim()
    half = TANGENT * (high - low)
    label: str | None = "slope from multipliers"
    for point in points:
        slope, (x, y) = point["slope"]["from_multipliers"], point["position"]
        if slope is not None:
            # No taller than wide on the page: a steep slope keeps its direction, not its length.
            bottom, top = axes.get_ylim()
            reach = min(half, TANGENT * (top - bottom) / abs(slope)) if slope else half
            ends = [x - reach, x + reach], [y - slope * reach, y + slope * reach]
            axes.plot(*ends, color=style.ORANGE, linewidth=1.2, label=label)
            label = None


def _label(axis: dict[str, Any]) -> str:
    return f"{wording.quantity(axis['name'])}, {'–' if axis['unit'] == '1' else axis['unit']}"


def _parameter(content: dict[str, Any]) -> str:
    parameter = content["parameter"]
    return wording.quantity(parameter["name"]) + ("" if parameter["unit"] == "1" else f" in {parameter['unit']}")
