"""Which discipline hands what to which, from the recorded graph of one evaluation."""

from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Design structure matrix"
CAPTION = (
    "Disciplines on the diagonal in the order of evaluation. A number says how many values the discipline to its left "
    "hands directly to the one below; it was counted in the autograd graph of one evaluation (of blades, the loads at "
    "every station). Nothing stands below the diagonal: no discipline waits for a later one, and the optimizer closes "
    "trim and all other constraints."
)
NEEDS = ("data_flow",)


def draw(run: StoredRun) -> Figure:
    flow = run.analysis["data_flow"]
    names = flow["blocks"]
    count = len(names)
    figure = style.figure(5.6)
    axes = figure.subplots()
    for i, name in enumerate(names):
        is_end = i in (0, count - 2, count - 1)
        color = style.GREEN if is_end else style.AFTER
        axes.add_patch(Rectangle((i - 0.6, i - 0.4), 1.2, 0.8, facecolor=style.tint(color), edgecolor=color))
        axes.text(i, i, _wrapped(name), ha="center", va="center", fontsize=6.5)
    for entry in flow["passes"]:
        row, column = names.index(entry["from"]), names.index(entry["to"])
        axes.plot([row, column, column], [row, row, column], color=style.GRID, linewidth=1.0, zorder=0)
        axes.add_patch(
            Rectangle(
                (column - 0.36, row - 0.26), 0.72, 0.52, facecolor=style.SURFACE, edgecolor=style.MUTED, linewidth=0.6
            )
        )
        axes.text(column, row, str(entry["count"]), ha="center", va="center", fontsize=7.5)
    axes.set(xlim=(-0.65, count - 0.35), ylim=(count - 0.4, -0.6))
    axes.set_axis_off()
    axes.set_title(TITLE)
    return figure


def _wrapped(name: str) -> str:
    """Two lines at most, broken at the blank nearest to the middle."""
    blanks = [i for i, letter in enumerate(name) if letter == " "]
    if not blanks or len(name) < 9:
        return name
    middle = min(blanks, key=lambda i: abs(i - len(name) / 2))
    return f"{name[:middle]}\n{name[middle + 1 :]}"
