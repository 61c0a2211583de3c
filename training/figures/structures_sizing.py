"""Figure: the sized airframe from above, gauges on the port side, use of the limits on the starboard side."""

import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from torch import Tensor

from lpc_mdo.structures.airframe import FUSELAGE_CASES, WING_CASES
from lpc_mdo.structures.frame import Topology
from lpc_mdo.structures.sizing import BOX_LIMITS, TUBE_LIMITS, Frames, SizingModel
from lpc_mdo.surrogates.structural_mass import StructuralInputs

FIN_PLACE = 4.6  # m to starboard, where the fin is drawn in side view


def _largest_shares(model: SizingModel, f: Frames, shares: Tensor) -> dict[str, np.ndarray]:
    """Largest share (element,) of strength and stability over cases, ends and kinds, by frame."""
    count = f.wing.spanwise
    tubes = len(f.wing.topology.elements) - count
    layout = {
        "wing": (len(WING_CASES), count, 2 * len(BOX_LIMITS)),
        "booms": (len(WING_CASES), tubes, 2 * len(TUBE_LIMITS)),
        "stiffness": (len(WING_CASES) + 4, 1, 1),
        "fuselage": (len(FUSELAGE_CASES), len(f.fuselage.topology.elements), 2 * len(TUBE_LIMITS)),
        **{name: (1, len(tail.topology.elements), 2 * len(BOX_LIMITS)) for name, tail in f.tails.items()},
    }
    parts = shares.split([int(np.prod(shape)) for shape in layout.values()])
    return {
        name: part.reshape(shape).amax((0, 2)).numpy()
        for (name, shape), part in zip(layout.items(), parts, strict=True)
    }


def _quadrilaterals(points: Tensor, topology: Topology, width: Tensor, axes: tuple[int, int]) -> np.ndarray:
    """Outlines (element, 4, 2) in the plane of two axes; width (element, 2) at both ends, across the element."""
    ends = points[topology.elements][..., list(axes)].numpy()
    along = ends[:, 1] - ends[:, 0]
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.linalg.norm(along, axis=-1, keepdims=True)
    half = 0.5 * width.numpy()[..., None] * across[:, None]
    return np.stack(
        [ends[:, 0] - half[:, 0], ends[:, 0] + half[:, 0], ends[:, 1] + half[:, 1], ends[:, 1] - half[:, 1]], 1
    )


def _outlines(f: Frames) -> dict[str, np.ndarray]:
    """By frame (element, 4, 2): y to starboard and x aft; the fin in side view, x for y."""
    count, wing, body = f.wing.spanwise, f.wing, f.fuselage
    box = Topology(wing.topology.elements[:count], wing.topology.up, wing.topology.is_fixed)
    booms = Topology(wing.topology.elements[count:], wing.topology.up, wing.topology.is_fixed)
    diameter = 2.0 * wing.tube.semi_axis_y[:, None].expand(-1, 2)
    tail, fin = f.tails["horizontal_tail"], f.tails["vertical_tail"]
    upright = _quadrilaterals(fin.points, fin.topology, fin.box.width, (0, 2))
    upright = np.stack([upright[..., 1] - float(fin.points[0, 2]) + FIN_PLACE, upright[..., 0]], axis=-1)
    return {
        "wing": _quadrilaterals(wing.points, box, wing.box.width, (1, 0)),
        "booms": _quadrilaterals(wing.points, booms, diameter, (1, 0)),
        "fuselage": _quadrilaterals(body.points, body.topology, 2.0 * body.ends.semi_axis_y, (1, 0)),
        "horizontal_tail": _quadrilaterals(tail.points, tail.topology, tail.box.width, (1, 0)),
        "vertical_tail": upright,
    }


def _walls(f: Frames) -> dict[str, np.ndarray]:
    """Thickness (element,) mm: skins of boxes, walls of shells."""
    body = f.fuselage.ends.wall.expand_as(f.fuselage.ends.semi_axis_y).mean(-1)
    found = {"wing": f.wing.box.skin.mean(-1), "booms": f.wing.tube.wall, "fuselage": body}
    found |= {name: tail.box.skin.mean(-1) for name, tail in f.tails.items()}
    return {name: 1e3 * wall.numpy() for name, wall in found.items()}


def _planform(axes: Axes, f: Frames) -> None:
    """Leading and trailing edges of wing and tail, both sides."""
    offset, share = f.wing.airframe.box_offset, 0.25
    for points, chord in (
        (f.wing.points[f.wing.chain], f.wing.chord),
        (f.tails["horizontal_tail"].points, f.tails["horizontal_tail"].chord),
    ):
        chords = torch.cat([chord[:1, 0], chord[:, 1]])
        front, rear = (points[:, 0] - (offset + share) * chords, points[:, 0] + (1.0 - offset - share) * chords)
        for side in (-1.0, 1.0):
            y = side * points[:, 1]
            outline = torch.cat([front, rear.flip(0)]).numpy()
            axes.plot(torch.cat([y, y.flip(0)]).numpy(), outline, color="#999999", linewidth=0.7, zorder=0)


def _clipped(polygons: np.ndarray, side: float) -> np.ndarray:
    """The half of outlines on one side of the plane of symmetry."""
    inner = np.maximum(side * polygons[..., 0], 0.0)
    return np.stack([side * inner, polygons[..., 1]], axis=-1)


def sizing_figure(model: SizingModel, inputs: StructuralInputs, x: Tensor) -> Figure:
    """For scalar inputs and logarithms of gauges x (variable,)."""
    f = model.frames(inputs, x)
    shares = _largest_shares(model, f, model(inputs, x).shares)
    walls, outlines = _walls(f), _outlines(f)
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(24.0, 1.0))
    axes = figure.add_subplot(grid[0, :])
    _planform(axes, f)
    thickest = max(float(wall.max()) for wall in walls.values())
    for values, side, cmap, limits, label in (
        (walls, -1.0, "viridis_r", (1.0, thickest), "port: wall thickness, mm"),
        (shares, 1.0, "cividis", (0.0, 1.0), "starboard: largest share of strength or stability used"),
    ):
        for name, polygons in outlines.items():
            drawn = _clipped(polygons, side) if name == "fuselage" else polygons * np.array([side, 1.0])
            collection = PolyCollection(drawn, array=values[name], cmap=cmap, edgecolors="white", linewidths=0.4)
            collection.set_clim(*limits)
            axes.add_collection(collection)
        place = figure.add_subplot(grid[1, 0 if side < 0.0 else 1])
        figure.colorbar(collection, cax=place, orientation="horizontal", label=label)
    for side in (-1.0, 1.0):
        axes.text(side * (FIN_PLACE + 0.9), 9.3, "fin, side view", ha="center", va="top", fontsize=8)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.set_xlabel("y, m")
    axes.set_ylabel("x, m (aft)")
    axes.set_title(
        f"sized structure at the baseline: {float(f.mass):.0f} kg; boxes and shells as the frames see them", fontsize=10
    )
    return figure
