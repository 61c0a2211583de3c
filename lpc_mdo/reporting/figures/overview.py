"""Initial and optimized aircraft side by side: top and front view at one scale, with the figures that matter."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun
from lpc_mdo.reporting.tables import POUNDS_PER_KILOGRAM

TITLE = "Initial and optimized aircraft"
CAPTION = (
    "Both aircraft from above and from ahead at one scale, blades with their true planform. The initial design is a set of "
    "start values: it is not trimmed and does not meet the requirements."
)
NEEDS = ("outlines",)
HEIGHT = 5.45
FULL_WIDTH = 9.0
HALF_WIDTH = 8.6  # m either side of the plane of symmetry that the views show
LAYERS = ("booms", "wing", "horizontal_tail", "fuselage", "vertical_tail")


def draw(run: StoredRun) -> Figure:
    """Both aircraft to scale, the optimized one over the initial one's outline."""
    figure = style.figure(HEIGHT, FULL_WIDTH)
    figure.get_layout_engine().set(w_pad=0.02, h_pad=0.02, hspace=0.0, wspace=0.0)
    grid = figure.add_gridspec(2, 2, height_ratios=(16.5, 4.0))
    designs = (
        ("Initial", "start values, not trimmed", run.initial, style.BEFORE),
        ("Optimized", "dashed: initial wing", run.optimized, style.AFTER),
    )
    for column, (name, note, design, color) in enumerate(designs):
        top, front = (figure.add_subplot(grid[row, column]) for row in (0, 1))
        _top(top, design, color)
        _front(front, design, color)
        if column == 1:
            for axes, view in ((top, "top"), (front, "front")):
                _ghost(axes, run.initial["outlines"][view]["wing"][0])
        _caption(top, name, note, design["summary"], color)
    return figure


def _caption(axes: Axes, name: str, note: str, summary: dict[str, Any], color: str) -> None:
    mass = summary["gross_mass_kg"]
    title = axes.annotate(name, (-HALF_WIDTH + 0.2, -4.0), fontsize=14, fontweight="bold", color=color, va="baseline")
    axes.annotate(
        note, (1.0, 0.0), xycoords=title, xytext=(8, 2), textcoords="offset points", fontsize=9, color=style.MUTED
    )
    facts = (
        (f"{mass * POUNDS_PER_KILOGRAM:.0f} lb ({mass:.0f} kg)", "gross weight"),
        (f"{summary['lift_to_drag_cruise']:.1f}", "L/D in cruise"),
        (f"{summary['sound_pressure_level_dba']:.1f} dB(A)", "hover noise"),
    )
    for x, (value, label) in zip((-HALF_WIDTH + 0.2, -0.9, 4.0), facts, strict=True):
        axes.text(x, -2.55, value, fontsize=11.5, va="center")
        axes.text(x, -1.75, label, fontsize=9, color=style.MUTED, va="center")


def _bodies(axes: Axes, outlines: dict[str, Any], color: str) -> None:
    for layer in LAYERS:
        for polygon in outlines[layer]:
            axes.add_patch(Polygon(polygon, facecolor=style.tint(color), edgecolor=color, linewidth=1.0, zorder=3))


def _top(axes: Axes, design: dict[str, Any], color: str) -> None:
    """Seen from above, nose up the page, starboard to the right."""
    _bodies(axes, design["outlines"]["top"], color)
    for rotor in design["rotors"]:
        x, y, _ = rotor["hub_m"]
        if rotor["kind"] == "lift":
            axes.add_patch(Circle((y, x), rotor["radius_m"], facecolor=color, alpha=0.10, edgecolor="none", zorder=4))
            axes.add_patch(
                Circle((y, x), rotor["radius_m"], facecolor="none", edgecolor=color, linewidth=0.7, zorder=4)
            )
            _blades(axes, rotor, color)
        else:
            axes.plot([y - rotor["radius_m"], y + rotor["radius_m"]], [x, x], color=color, linewidth=1.8, zorder=4)
    span = design["summary"]["wing_span_m"]
    _dimension(axes, 0.5 * span, 11.1, f"span {span:.1f} m")
    style.bare(axes)
    axes.set(xlim=(-HALF_WIDTH, HALF_WIDTH), ylim=(11.8, -4.7))


def _blades(axes: Axes, rotor: dict[str, Any], color: str) -> None:
    """Each blade's planform, chord about its quarter chord, in the disk."""
    r, chord = np.array(rotor["station_m"]), np.array(rotor["chord_m"])
    shape = np.concatenate([np.stack([r, 0.25 * chord], 1), np.stack([r, -0.75 * chord], 1)[::-1]])
    for i in range(rotor["blades"]):
        angle = np.pi * 2.0 * i / rotor["blades"] + 0.9 * rotor["spin"]
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        shape_here = shape * np.array([1.0, rotor["spin"]])
        center = np.array([rotor["hub_m"][1], rotor["hub_m"][0]])
        axes.add_patch(Polygon(shape_here @ turn.T + center, facecolor=color, linewidth=0.0, zorder=5))


def _front(axes: Axes, design: dict[str, Any], color: str) -> None:
    """Seen from ahead, starboard to the left."""
    _bodies(axes, design["outlines"]["front"], color)
    for rotor in design["rotors"]:
        _, y, z = rotor["hub_m"]
        radius = rotor["radius_m"]
        if rotor["kind"] == "lift":
            axes.plot([y - radius, y + radius], [z, z], color=color, linewidth=1.8, zorder=4)
        else:
            axes.add_patch(Circle((y, z), radius, facecolor=color, alpha=0.10, edgecolor="none", zorder=2))
            axes.add_patch(Circle((y, z), radius, facecolor="none", edgecolor=color, linewidth=0.7, zorder=2))
    style.bare(axes)
    axes.set(xlim=(HALF_WIDTH, -HALF_WIDTH), ylim=(0.5, 4.5))


def _ghost(axes: Axes, outline: list[list[float]]) -> None:
    """The initial wing, dashed, behind the optimized aircraft."""
    axes.add_patch(
        Polygon(outline, facecolor="none", edgecolor=style.BEFORE, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
    )


def _dimension(axes: Axes, half: float, at: float, text: str) -> None:
    arrow = {"arrowstyle": "|-|,widthA=0.35,widthB=0.35", "color": style.MUTED, "linewidth": 0.9, "shrinkA": 0}
    axes.annotate("", (-half, at), (half, at), arrowprops=arrow | {"shrinkB": 0})
    axes.text(0.0, at, text, ha="center", va="center", fontsize=10, backgroundcolor=style.SURFACE)
