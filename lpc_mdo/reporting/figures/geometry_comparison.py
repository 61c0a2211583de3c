"""Three views of the aircraft after optimization over its shape before."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lpc_mdo.reporting import style
from lpc_mdo.reporting.views import FRONT, SIDE, TOP, bodies, facets, hull, outline, shade, true_to_scale

TITLE = "Outer mold line before and after optimization"
COLORS = {"before": style.BEFORE, "after": style.AFTER}
LINES = {"before": "--", "after": "-"}


def draw(before: dict[str, Any], after: dict[str, Any]) -> Figure:
    """Two shapes as `lpc_mdo.reporting.mold` stores them: before grey, dashed; after blue bodies and orange disks over
    shaded facets. One scale, in m."""
    figure = style.figure(7.0, 10.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(16.0, 11.5), height_ratios=(10.0, 4.6))
    views = {"From above": (TOP, grid[0, 0]), "From ahead": (FRONT, grid[1, 0]), "From port": (SIDE, grid[1, 1])}
    for title, (view, cell) in views.items():
        axes = figure.add_subplot(cell)
        shade(axes, view, bodies(after))
        for name, mold in (("before", before), ("after", after)):
            for component, grids in mold["surfaces"].items():
                if component.startswith("boom_"):
                    hull(axes, view, np.asarray(grids[0]), COLORS[name], line=LINES[name])
                elif not component.startswith("hub_"):
                    outline(axes, view, facets(grids), COLORS[name], line=LINES[name])
            for rim in mold["disks"].values():
                color = style.BEFORE if name == "before" else style.ORANGE
                hull(axes, view, np.asarray(rim), color, line=LINES[name])
        true_to_scale(axes, title)
    key = figure.add_subplot(grid[0, 1])
    key.set_axis_off()
    lines = [
        Line2D([], [], color=style.BEFORE, linestyle="--", linewidth=1.2),
        Line2D([], [], color=style.AFTER, linewidth=1.4),
        Line2D([], [], color=style.ORANGE, linewidth=1.4),
    ]
    key.legend(lines, ["before", "after: bodies", "after: rotor disks"], loc="upper left")
    key.text(0.03, 0.70, _table(before, after), transform=key.transAxes, va="top", fontsize=8, family="monospace")
    return figure


def _table(before: dict[str, Any], after: dict[str, Any]) -> str:
    """What the shapes measure, one line each."""
    rows = [f"{'':<22}{'before':>9}{'after':>9}"]
    for surface, key, label, unit in (
        ("wing", "area_m2", "wing area", "m²"),
        ("wing", "aspect_ratio", "wing aspect ratio", ""),
        ("wing", "span_m", "wing span", "m"),
        ("tail", "area_m2", "tail area", "m²"),
        ("tail", "aspect_ratio", "tail aspect ratio", ""),
    ):
        rows.append(_row(label, [float(mold[surface][key]) for mold in (before, after)], unit))
    for index, label in ((0, "lift rotor radius"), (-1, "pusher radius")):
        rows.append(_row(label, [float(mold["rotor_radius_m"][index]) for mold in (before, after)], "m"))
    return "\n".join(rows)


def _row(label: str, values: list[float], unit: str) -> str:
    return f"{label:<22}{values[0]:>9.3f}{values[1]:>9.3f} {unit}"
