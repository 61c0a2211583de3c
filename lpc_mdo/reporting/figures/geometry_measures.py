"""Measures on the geometry: three views with spans, chords, arms, diameters and the fuselage."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun
from lpc_mdo.reporting.views import FRONT, SIDE, TOP, bodies, dimension, hull, shade, true_to_scale

TITLE = "Measures on the geometry"
CAPTION = (
    "The optimized aircraft with its measures in metres, read off the same control points as the meshes. Bold: mean "
    "aerodynamic chords, where the half's chord has that length. All views are true to scale."
)
NEEDS = ("mold",)
HEIGHT = 6.7


def draw(run: StoredRun) -> Figure:
    return plot(run.optimized["mold"])


def plot(mold: dict[str, Any]) -> Figure:
    """Three views of a shape as `lpc_mdo.reporting.mold` stores it."""
    figure = style.figure(HEIGHT)
    grid = figure.add_gridspec(2, 2, height_ratios=(2.4, 1.0))
    panels = (
        ("From above", TOP, grid[0, :], _from_above),
        ("From ahead", FRONT, grid[1, 0], _from_ahead),
        ("From port", SIDE, grid[1, 1], _from_port),
    )
    covered = bodies(mold)
    for title, view, cell, measure in panels:
        axes = figure.add_subplot(cell)
        shade(axes, view, covered)
        for rim in mold["disks"].values():
            hull(axes, view, np.asarray(rim), style.GREEN, 0.6, fill=0.12)
        measure(axes, mold)
        true_to_scale(axes, title)
    return figure


def _from_above(axes: Axes, mold: dict[str, Any]) -> None:
    nose, span, tip = mold["fuselage"]["nose_m"][0], mold["wing"]["span_m"], TOP.flat(np.asarray(mold["wing"]["tip_m"]))
    ends = TOP.flat(np.array([[nose, -0.5 * span, 0.0], [nose, 0.5 * span, 0.0]]))
    dimension(axes, *ends, f"span {span:.2f}", (0.0, 1.6))
    dimension(axes, *tip, f"tip {np.linalg.norm(tip[1] - tip[0]):.2f}", (0.45, 0.0), aside=(0.75, 0.0))
    low = TOP.flat(np.asarray(mold["hubs_m"]))[:, 1].min()
    _mean_chord(axes, mold["wing"], mold["wing_mesh"], "wing", style.BLUE, (-0.5 * span - 0.3, low - 0.1))
    tail_place = (0.25 * span, low + 1.2)
    _mean_chord(axes, mold["tail"], mold["tail_mesh"], "tail", style.ORANGE, tail_place)
    hub, radius = np.asarray(mold["hubs_m"][1]), mold["rotor_radius_m"][1]
    across = TOP.flat(hub + np.array([[0.0, -radius, 0.0], [0.0, radius, 0.0]]))
    dimension(axes, *across, f"diameter {2 * radius:.2f}", color=style.GREEN)
    arm = [np.asarray(mold[name]["aerodynamic_center_m"]) for name in ("wing", "tail")]
    dimension(axes, *TOP.flat(np.array(arm) * [1, 0, 1]), f"tail arm {arm[1][0] - arm[0][0]:.2f}")


def _mean_chord(
    axes: Axes, measures: dict[str, Any], mesh: Any, name: str, color: str, place: tuple[float, float]
) -> None:
    """The mean aerodynamic chord to port, and beside it area and aspect ratio."""
    points, length = np.asarray(mesh), measures["mean_chord_m"]
    chords = np.linalg.norm(points[-1] - points[0], axis=-1)
    y = float(np.interp(-length, -chords, points[0, :, 1]))
    x = measures["aerodynamic_center_m"][0]
    start, end = TOP.flat(np.array([[x - 0.25 * length, -y, 0.0], [x + 0.75 * length, -y, 0.0]]))
    axes.plot(*np.transpose([start, end]), color=color, linewidth=2.6, zorder=8, solid_capstyle="butt")
    text = (
        f"{name}: area {measures['area_m2']:.2f} m²\naspect ratio {measures['aspect_ratio']:.2f}\n"
        f"mean aerodynamic chord {length:.3f}"
    )
    axes.text(*place, text, color=color, fontsize=8, va="top", linespacing=1.25)


def _from_ahead(axes: Axes, mold: dict[str, Any]) -> None:
    body = mold["fuselage"]
    half, keel = 0.5 * body["width_m"], body["roof_m"] - body["height_m"]
    dimension(
        axes,
        np.array([0.0, keel]),
        np.array([0.0, body["roof_m"]]),
        f"{body['height_m']:.3f}",
        (-1.75, 0.0),
        aside=(-1.1, 0.0),
    )
    dimension(
        axes, np.array([-half, keel]), np.array([half, keel]), f"{body['width_m']:.3f}", (0.0, -0.4), aside=(0.0, -0.5)
    )
    hubs = FRONT.flat(np.asarray(mold["hubs_m"]))
    port = hubs[hubs[:, 0] > 0.0]
    inner, outer = port[port[:, 0].argmin()], port[port[:, 0].argmax()]
    start, text = (inner, "hubs") if outer[0] > inner[0] else (np.array([0.0, outer[1]]), "hub")
    level = np.array([outer[0], start[1]])
    dimension(axes, start, level, f"{text} {outer[0] - start[0]:.2f}", (0.0, -0.75), aside=(0.0, -0.5))


def _from_port(axes: Axes, mold: dict[str, Any]) -> None:
    body = mold["fuselage"]
    keel, nose = body["roof_m"] - body["height_m"], body["nose_m"][0]
    ends = SIDE.flat(np.array([[nose, 0.0, keel], [nose + body["length_m"], 0.0, keel]]))
    dimension(axes, *ends, f"fuselage {body['length_m']:.3f}", (0.0, -0.45))
    lift = np.asarray(mold["hubs_m"])[:-1]
    lift = lift[np.abs(lift[:, 1]) > np.abs(lift[:, 1]).max() - 0.01]  # of the outermost booms
    ends = SIDE.flat(np.stack([lift[lift[:, 0].argmin()], lift[lift[:, 0].argmax()]]))
    ends[:, 1] = ends[:, 1].max()
    dimension(axes, *ends, f"hubs {abs(ends[1, 0] - ends[0, 0]):.2f}", (0.0, 1.2))
