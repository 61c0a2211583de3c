"""Three views of the aircraft after optimization over its shape before."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.parameterization import ShapeParameters
from lpc_mdo.reporting.views import (
    BLUE,
    FRONT,
    MUTED,
    ORANGE,
    SIDE,
    TOP,
    component_meshes,
    hull,
    outline,
    shade,
    true_to_scale,
)

TITLE = "Outer mold line before and after optimization"
BEFORE, BODY = MUTED, "#e6e8eb"


def draw(mold: OuterMoldLine, before: ShapeParameters, after: ShapeParameters) -> Figure:
    """Before: grey, dashed; after: blue bodies and orange disks over shaded facets. One scale, in m."""
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(16.0, 11.5), height_ratios=(10.0, 4.6))
    views = {"From above": (TOP, grid[0, 0]), "From ahead": (FRONT, grid[1, 0]), "From port": (SIDE, grid[1, 1])}
    designs = {name: component_meshes(mold, shape) for name, shape in (("before", before), ("after", after))}
    for title, (view, cell) in views.items():
        axes = figure.add_subplot(cell)
        shade(axes, view, [mesh for name, mesh in designs["after"].items() if not name.startswith("disk_")], BODY)
        for name in designs["before"]:
            if name.startswith("hub_"):
                continue
            trace = hull if name.startswith(("boom_", "disk_")) else outline
            trace(axes, view, designs["before"][name], BEFORE, 0.9, "--")
            trace(axes, view, designs["after"][name], ORANGE if name.startswith("disk_") else BLUE, 1.1)
        true_to_scale(axes, title)
    key = figure.add_subplot(grid[0, 1])
    key.set_axis_off()
    lines = [
        Line2D([], [], color=BEFORE, linestyle="--", linewidth=1.2),
        Line2D([], [], color=BLUE, linewidth=1.4),
        Line2D([], [], color=ORANGE, linewidth=1.4),
    ]
    key.legend(lines, ["before", "after: bodies", "after: rotor disks"], frameon=False, loc="upper left", fontsize=9)
    key.text(0.03, 0.70, _table(before, after), transform=key.transAxes, va="top", fontsize=8.5, family="monospace")
    return figure


def _table(before: ShapeParameters, after: ShapeParameters) -> str:
    """What the shapes were asked for, one line each."""
    rows = [f"{'':<22}{'before':>9}{'after':>9}"]
    for name, label, unit in (
        ("wing_area", "wing area", "m²"),
        ("wing_aspect_ratio", "wing aspect ratio", ""),
        ("tail_area", "tail area", "m²"),
        ("tail_aspect_ratio", "tail aspect ratio", ""),
        ("tail_position", "tail quarter chord x", "m"),
    ):
        values = [float(getattr(shape, name)) for shape in (before, after)]
        rows.append(f"{label:<22}{values[0]:>9.3f}{values[1]:>9.3f} {unit}")
    for index, label in ((0, "lift rotor radius"), (8, "pusher radius")):
        values = [float(shape.rotor_radius[index]) for shape in (before, after)]
        rows.append(f"{label:<22}{values[0]:>9.3f}{values[1]:>9.3f} m")
    return "\n".join(rows)
