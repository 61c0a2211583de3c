"""The outer mold line with the projected camber meshes, and its measures drawn on it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.geometry.shape import Geometry, Shape, SurfaceMeasures
from lpc_mdo.reporting.views import (
    BLUE,
    FRONT,
    GREEN,
    OBLIQUE,
    ORANGE,
    SIDE,
    TOP,
    View,
    component_meshes,
    dimension,
    hull,
    shade,
    true_to_scale,
)

TITLE = "Outer mold line with its camber meshes and measures"
BODY = "#d9dde2"
MIRROR = np.array([1.0, -1.0, 1.0])

Array = NDArray[np.float64]


def draw(geometry: Geometry, parameters: ShapeParameters) -> Figure:
    """Four views of one design to one scale a row, lengths in m."""
    mold = geometry.outer_mold_line
    meshes = component_meshes(mold, parameters)
    solid = [mesh for name, mesh in meshes.items() if not name.startswith("disk_")]
    disks = [mesh for name, mesh in meshes.items() if name.startswith("disk_")]
    shape = geometry(parameters)
    figure = Figure(figsize=(11.0, 7.9), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.75, 0.75), width_ratios=(1.0, 1.0))
    panels = {
        "Outer mold line with the projected camber meshes": OBLIQUE,
        "From above: measures in m": TOP,
        "From ahead": FRONT,
        "From port": SIDE,
    }
    for cell, (title, view) in zip(grid, panels.items(), strict=True):
        axes = figure.add_subplot(cell)
        shade(axes, view, solid, BODY)
        for disk in disks:
            hull(axes, view, disk, GREEN, 0.6, fill=0.12)
        if view in (OBLIQUE, TOP):
            _mesh(axes, view, shape.wing_mesh.numpy(), BLUE)
            _mesh(axes, view, shape.tail_mesh.numpy(), ORANGE)
        _MEASURES.get(view, lambda *_: None)(axes, geometry, shape, parameters)
        true_to_scale(axes, title)
    return figure


def _mesh(axes: Axes, view: View, mesh: Array, color: str) -> None:
    """Lines of a mesh (chordwise, spanwise, 3) and of its image to port."""
    for half in (mesh, mesh * MIRROR):
        flat = view.flat(half)
        lines = [*flat, *flat.swapaxes(0, 1)]
        axes.add_collection(LineCollection(lines, colors=color, linewidths=0.7, zorder=5))


def _from_above(axes: Axes, geometry: Geometry, shape: Shape, parameters: ShapeParameters) -> None:
    span = float(shape.wing.span)
    mesh = shape.wing_mesh.numpy()
    nose = geometry.vehicle.fuselage.nose[0]
    ends = TOP.flat(np.array([[nose, -0.5 * span, 0.0], [nose, 0.5 * span, 0.0]]))
    dimension(axes, *ends, f"span {span:.2f}", (0.0, 1.6))
    tip = TOP.flat(geometry.arrays["wing_edges"](geometry.outer_mold_line.control_points(parameters)).numpy()[:, -1])
    dimension(axes, *tip, f"tip {np.linalg.norm(tip[1] - tip[0]):.2f}", (0.45, 0.0), aside=(0.95, 0.0))
    _mean_chord(axes, shape.wing, "wing", BLUE, mesh)
    _mean_chord(axes, shape.tail, "tail", ORANGE, shape.tail_mesh.numpy())
    hub, radius = shape.hubs[1].numpy(), float(parameters.rotor_radius[1])
    across = TOP.flat(hub + np.array([[0.0, -radius, 0.0], [0.0, radius, 0.0]]))
    dimension(axes, *across, f"diameter {2 * radius:.2f}", color=GREEN)
    arm = [shape.wing.aerodynamic_center.numpy(), shape.tail.aerodynamic_center.numpy()]
    dimension(axes, *TOP.flat(np.array(arm) * [1, 0, 1]), f"tail arm {arm[1][0] - arm[0][0]:.2f}")


def _mean_chord(axes: Axes, measures: SurfaceMeasures, name: str, color: str, mesh: Array) -> None:
    """The mean aerodynamic chord to port, where the half's chord has that length, with area and aspect ratio."""
    chords = np.linalg.norm(mesh[-1] - mesh[0], axis=-1)
    y = float(np.interp(-float(measures.mean_chord), -chords, mesh[0, :, 1]))
    x = float(measures.aerodynamic_center[0])
    length = float(measures.mean_chord)
    start, end = TOP.flat(np.array([[x - 0.25 * length, -y, 0.0], [x + 0.75 * length, -y, 0.0]]))
    axes.plot(*np.transpose([start, end]), color=color, linewidth=2.6, zorder=8, solid_capstyle="butt")
    text = (
        f"{name}: area {float(measures.area):.2f} m², aspect ratio {float(measures.aspect_ratio):.2f},\n"
        f"mean aerodynamic chord {length:.3f} (bold)"
    )
    place = (-7.6, -10.2) if name == "wing" else (2.3, -8.6)
    axes.text(*place, text, color=color, fontsize=8, va="top", linespacing=1.25)


def _from_ahead(axes: Axes, geometry: Geometry, shape: Shape, parameters: ShapeParameters) -> None:
    body, roof = geometry.vehicle.fuselage, geometry.outer_mold_line.roof_height
    dimension(axes, np.array([0.0, roof - body.height]), np.array([0.0, roof]), f"{body.height:.3f}", (-1.75, 0.0))
    floor = np.array([[-0.5 * body.width, roof - body.height], [0.5 * body.width, roof - body.height]])
    dimension(axes, *floor, f"{body.width:.3f}", (0.0, -0.45))
    pairs = (("front_inner_starboard", "front_outer_starboard"),)
    names = [rotor.name for rotor in geometry.vehicle.rotors]
    for inner, outer in pairs:
        ends = FRONT.flat(np.stack([shape.hubs[names.index(name)].numpy() for name in (inner, outer)]))
        ends[:, 1] = ends[0, 1]
        dimension(axes, *ends, f"{ends[1, 0] - ends[0, 0]:.2f}", (0.0, -0.75))


def _from_port(axes: Axes, geometry: Geometry, shape: Shape, parameters: ShapeParameters) -> None:
    body, roof = geometry.vehicle.fuselage, geometry.outer_mold_line.roof_height
    keel = roof - body.height
    ends = SIDE.flat(np.array([[body.nose[0], 0.0, keel], [body.nose[0] + body.length, 0.0, keel]]))
    dimension(axes, *ends, f"fuselage {body.length:.3f}", (0.0, -0.45))
    front, rear = shape.hubs[0].numpy(), shape.hubs[1].numpy()
    ends = SIDE.flat(np.stack([front, rear]))
    ends[:, 1] = ends[:, 1].max()
    dimension(axes, *ends, f"hubs {rear[0] - front[0]:.2f}", (0.0, 1.2))


_MEASURES = {TOP: _from_above, FRONT: _from_ahead, SIDE: _from_port}
