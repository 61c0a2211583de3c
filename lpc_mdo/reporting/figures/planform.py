"""Initial outline over the optimized aircraft, from above and from the side."""

from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Geometry before and after"
CAPTION = "Outlines of the initial aircraft (grey, dashed) over the optimized one (blue), true to scale, in metres."
NEEDS = ("outlines",)
CHANGING = ("wing", "horizontal_tail")
LOOKS = (
    ("initial", {"edgecolor": style.BEFORE, "linestyle": (0, (4, 2)), "linewidth": 1.0, "zorder": 3}),
    ("optimized", {"edgecolor": style.AFTER, "linewidth": 1.2, "zorder": 4}),
)


def draw(run: StoredRun) -> Figure:
    figure = style.figure(3.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.45, 1.0))  # of the lengths that they show: one scale
    for name, look in LOOKS:
        design = run.analysis["designs"][name]
        for axes, view in ((left, "top"), (right, "side")):
            for part, polygons in design["outlines"][view].items():
                # The initial booms and body would only repeat, displaced, what does not change.
                if name == "optimized" or part in CHANGING:
                    for polygon in polygons:
                        axes.add_patch(Polygon(polygon, facecolor="none", **look))
        for rotor in design["rotors"]:
            x, y, z = rotor["hub_m"]
            radius = rotor["radius_m"]
            if rotor["kind"] == "lift":
                left.add_patch(Circle((y, x), radius, facecolor="none", **look))
                right.plot([x - radius, x + radius], [z, z], color=look["edgecolor"], linewidth=1.0)
            else:
                left.plot([y - radius, y + radius], [x, x], color=look["edgecolor"], linewidth=1.4)
                right.plot([x, x], [z - radius, z + radius], color=look["edgecolor"], linewidth=1.4)
    for axes, title in ((left, "From above"), (right, "From port")):
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.set_title(title)
    left.invert_yaxis()
    left.set(xlabel="y, m", ylabel="x, m")
    right.set(xlabel="x, m", ylabel="z, m")
    return figure
