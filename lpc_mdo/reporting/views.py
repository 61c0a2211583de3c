"""Orthographic views of the outer mold line for figures: shaded facets, and outlines of what they cover."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from lpc_mdo.geometry.mesh_files import QuadMesh, quad_mesh
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.parameterization import ShapeParameters

Array = NDArray[np.float64]

INK, MUTED, BLUE, ORANGE, GREEN = "#1b1f24", "#626a73", "#0072b2", "#d55e00", "#009e73"  # Okabe and Ito (2008)
LIGHT = np.array([-0.35, 0.30, 0.89])  # direction to the light
RESOLUTION = 16  # cells along each direction of a surface
FINE_RESOLUTION = 48  # of the fuselage and the disks, which show their facets first
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
FRONT = View((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SIDE = View((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))  # from port, nose to the right
OBLIQUE = _oblique(np.radians(40.0), np.radians(28.0))


def component_meshes(mold: OuterMoldLine, shape: ShapeParameters) -> dict[str, QuadMesh]:
    """Facets of each component of the deformed aircraft by name."""
    surfaces = mold.surfaces(mold.control_points(shape))
    meshes = {}
    for component, names in mold.components.items():
        is_fine = component == "fuselage" or component.startswith("disk_")
        own = {name: surfaces[name] for name in names}
        meshes[component] = quad_mesh(own, FINE_RESOLUTION if is_fine else RESOLUTION)
    return meshes


def shade(axes: Axes, view: View, meshes: Sequence[QuadMesh], color: str) -> None:
    """Paint facets from back to front, lit from above; as pixels, there are thousands."""
    corners = np.concatenate([mesh.points[mesh.quads] for mesh in meshes])
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
    axes: Axes, view: View, mesh: QuadMesh, color: str, width: float = 1.0, style: str = "-", fill: float = 0.0
) -> None:
    """The outline of a body without hollows; `fill` is the opacity within."""
    points = view.flat(mesh.points)
    # Disks seen edge-on have no area: joggled input (QJ) leaves a sliver as thin as the line.
    corners = points[ConvexHull(points, qhull_options="QJ").vertices]
    axes.add_patch(Polygon(corners, facecolor="none", edgecolor=color, linewidth=width, linestyle=style))
    if fill > 0.0:
        axes.add_patch(Polygon(corners, facecolor=color, edgecolor="none", alpha=fill))


def outline(axes: Axes, view: View, mesh: QuadMesh, color: str, width: float = 1.0, style: str = "-") -> None:
    """The border of what any body covers: facets painted on a page of its own, the edge of the paint as a contour."""
    facets = view.flat(mesh.points[mesh.quads])
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
    axes.contour(x, y, covered, levels=[0.5], colors=[color], linewidths=[width], linestyles=[style])


def dimension(
    axes: Axes,
    start: Array,
    end: Array,
    text: str,
    offset: tuple[float, float] = (0.0, 0.0),
    color: str = INK,
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
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    middle = 0.5 * (a + b) + np.asarray(aside or (0.0, 0.0))
    axes.text(*middle, text, ha="center", va="center", rotation=rotation, color=color, fontsize=8, bbox=box, zorder=9)


def true_to_scale(axes: Axes, title: str) -> None:
    """Equal scales, no frame, a title."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    axes.set_title(title, fontsize=9, color=MUTED, loc="left")
