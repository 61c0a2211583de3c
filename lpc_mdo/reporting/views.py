"""Orthographic views of the outer mold line for figures: shaded facets, and outlines of what they cover."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from lpc_mdo.reporting import style

Array = NDArray[np.float64]

BODY = "#c3c9d0"  # ink is told from it in the light and in the dark theme
MIRROR = np.array([1.0, -1.0, 1.0])
LIGHT = np.array([-0.35, 0.30, 0.89])  # direction to the light
PIXELS_PER_METRE = 90.0


@dataclass(frozen=True)
class View:
    """An orthographic view: unit vectors right and up the page; the eye looks against right x up."""

    right: tuple[float, float, float]
    up: tuple[float, float, float]

    def flat(self, points: Array) -> Array:
        """Coordinates (..., 2) on the page in m."""
        return points @ np.array([self.right, self.up]).T

    def depth(self, points: Array) -> Array:
        """Distance (...,) towards the eye in m."""
        return points @ np.cross(self.right, self.up)


def _oblique(azimuth: float, elevation: float) -> View:
    """From ahead on the port side and above; angles in rad."""
    eye = np.array([-np.cos(azimuth) * np.cos(elevation), -np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    return View(tuple(right), tuple(np.cross(eye, right)))


TOP = View((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))  # nose up the page
FRONT = View((0.0, -1.0, 0.0), (0.0, 0.0, 1.0))  # from ahead, starboard to the left
SIDE = View((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # from port, nose to the left
OBLIQUE = _oblique(np.radians(40.0), np.radians(28.0))


def facets(grids: Iterable[Any]) -> Array:
    """Corners (facet, 4, 3) of the cells of grids (u, v, 3)."""
    cells = []
    for grid in grids:
        points = np.asarray(grid, dtype=float)
        corners = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
        cells.append(np.stack(corners, axis=2).reshape(-1, 4, 3))
    return np.concatenate(cells)


def bodies(mold: dict[str, Any]) -> Array:
    """Facets of everything but the rotor disks."""
    return facets(grid for grids in mold["surfaces"].values() for grid in grids)


def shade(axes: Axes, view: View, corners: Array, color: str = BODY) -> None:
    """Paint facets (facet, 4, 3) from back to front, lit from above; as pixels, there are thousands."""
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    light = 0.72 + 0.28 * np.abs(normal @ (LIGHT / np.linalg.norm(LIGHT)))
    base = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    order = np.argsort(view.depth(corners.mean(1)))
    faces = np.clip(light[order, None] * base, 0.0, 1.0)
    axes.add_collection(
        PolyCollection(
            view.flat(corners[order]), facecolors=faces, edgecolors="none", antialiased=False, rasterized=True
        )
    )


def hull(
    axes: Axes, view: View, points: Array, color: str, width: float = 1.0, line: str = "-", fill: float = 0.0
) -> None:
    """The outline of a body without hollows, given by points (..., 3); `fill` is the opacity within."""
    flat = view.flat(points).reshape(-1, 2)
    # Disks seen edge-on have no area: joggled input (QJ) leaves a sliver as thin as the line.
    corners = flat[ConvexHull(flat, qhull_options="QJ").vertices]
    axes.add_patch(Polygon(corners, facecolor="none", edgecolor=color, linewidth=width, linestyle=line))
    if fill > 0.0:
        axes.add_patch(Polygon(corners, facecolor=color, edgecolor="none", alpha=fill))


def outline(axes: Axes, view: View, corners: Array, color: str, width: float = 1.0, line: str = "-") -> None:
    """The border of what facets (facet, 4, 3) cover: painted on a page of its own, the paint's edge as a contour."""
    facets = view.flat(corners)
    low, high = facets.min((0, 1)) - 0.1, facets.max((0, 1)) + 0.1
    inches = (high - low) * PIXELS_PER_METRE / 100.0
    canvas = FigureCanvasAgg(Figure(figsize=tuple(inches), dpi=100.0))
    whole = canvas.figure.add_axes((0.0, 0.0, 1.0, 1.0))
    whole.set_axis_off()
    whole.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    whole.add_collection(PolyCollection(facets, facecolors="black", edgecolors="black", linewidths=0.4))
    canvas.draw()
    covered = 1.0 - np.asarray(canvas.buffer_rgba())[::-1, :, 0] / 255.0
    x, y = (low[i] + (np.arange(covered.shape[1 - i]) + 0.5) * (high - low)[i] / covered.shape[1 - i] for i in (0, 1))
    axes.contour(x, y, covered, levels=[0.5], colors=[color], linewidths=[width], linestyles=[line])


def mesh_lines(axes: Axes, view: View, mesh: Any, color: str) -> None:
    """Lines of a camber mesh (chordwise, spanwise, 3) and of its image to port."""
    half = np.asarray(mesh)
    for points in (half, half * MIRROR):
        flat = view.flat(points)
        axes.add_collection(LineCollection([*flat, *flat.swapaxes(0, 1)], colors=color, linewidths=0.7, zorder=5))


def dimension(
    axes: Axes,
    start: Array,
    end: Array,
    text: str,
    offset: tuple[float, float] = (0.0, 0.0),
    color: str = style.INK,
    aside: tuple[float, float] | None = None,
) -> None:
    """A measure between two points (2,) on the page, its line moved by `offset` m.

    The text stands along the middle of the line, or level and `aside` (m) of it.
    """
    shift = np.asarray(offset)
    a, b = start + shift, end + shift
    for point, moved in ((start, a), (end, b)):
        if np.any(shift):
            axes.plot(*np.transpose([point, moved]), color=color, linewidth=0.5)
    axes.annotate(
        "", b, a, arrowprops={"arrowstyle": "<->", "color": color, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    )
    rotation = float(np.degrees(np.arctan2(*(b - a)[::-1])))
    rotation = (rotation + 90.0) % 180.0 - 90.0 if aside is None else 0.0
    box = {"facecolor": style.SURFACE, "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    middle = 0.5 * (a + b) + np.asarray(aside or (0.0, 0.0))
    axes.text(*middle, text, ha="center", va="center", rotation=rotation, color=color, fontsize=8, bbox=box, zorder=9)


def true_to_scale(axes: Axes, title: str) -> None:
    """Equal scales, no frame, a title."""
    axes.set_aspect("equal", anchor="N")
    axes.autoscale_view()
    axes.set_axis_off()
    axes.set_title(title, fontsize=9, color=style.MUTED, loc="left")
