"""One look for all figures: colours that the colour-blind tell apart (Okabe and Ito, 2008), type, grid."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation
from numpy.typing import NDArray

from lpc_mdo.files.write import write_atomically

INK, MUTED, GRID, SURFACE = "#1b1f24", "#626a73", "#d3d7dc", "#fefefe"
BLUE, ORANGE, GREEN, PINK, SKY, GOLD = "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"
CYCLE = (BLUE, ORANGE, GREEN, PINK, SKY, GOLD)
BEFORE, AFTER = "#8b929b", BLUE
SUPERSCRIPT = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
WIDTH = 7.2  # inches: a text column; type is set for it

SETTINGS = {
    "figure.facecolor": SURFACE,
    "savefig.facecolor": SURFACE,
    "axes.facecolor": "none",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "text.parse_math": False,  # names are the user's: a dollar sign is one
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "font.size": 9,
    "font.family": "DejaVu Sans",
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "lpc-mdo",
    "path.simplify": True,
}


@contextmanager
def look() -> Iterator[None]:
    """Within it, figures are drawn and saved in this look."""
    with rc_context(SETTINGS):
        yield


class _PowersOfTen(LogFormatterSciNotation):
    """Matplotlib's labels of logarithmic axes with superscript digits instead of its mathematical notation."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        label = super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")
        raised = re.sub(r"\^\{(.*?)\}", lambda power: power[1].translate(SUPERSCRIPT), label)
        return raised.replace(r"\times", "×")


def without_mathematics(drawn: Figure) -> Figure:
    """The figure with its labels of logarithmic axes as plain text, as all of its text is."""
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for kind in ("major", "minor"):
                if isinstance(getattr(axis, f"get_{kind}_formatter")(), LogFormatterSciNotation):
                    getattr(axis, f"set_{kind}_formatter")(_PowersOfTen(labelOnlyBase=kind == "major"))
    return drawn


def save(drawn: Figure, file: Path, **how: Any) -> None:
    """Write a figure in the format of the file's ending, whole or not at all."""
    stream = BytesIO()
    without_mathematics(drawn).savefig(stream, format=file.suffix[1:], **how)
    write_atomically(file, stream.getvalue())


def figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure of that size in inches, owned by nobody: no window, no global state."""
    return Figure(figsize=(width, height), layout="constrained")


def panels(rows: int, columns: int, row_height: float, **options: Any) -> tuple[Figure, NDArray[np.object_]]:
    """A figure of many small panels (rows, columns) and their axes; fixed margins, which a solver finds too slowly."""
    height = row_height * rows + 0.5
    new = Figure(figsize=(WIDTH, height))
    grid = new.subplots(rows, columns, squeeze=False, **options)
    new.subplots_adjust(left=0.075, right=0.98, bottom=0.5 / height, top=1.0 - 0.35 / height, wspace=0.28, hspace=0.42)
    return new, grid


def bare(axes: Axes) -> None:
    """Axes without frame, ticks and grid, equal scales."""
    axes.set_axis_off()
    axes.set_aspect("equal")


def tint(color: str) -> str:
    """The colour mixed with three parts of white, opaque, so that areas hide what lies beneath."""
    channels = [int(color[i : i + 2], 16) for i in (1, 3, 5)]
    return "#" + "".join(f"{round(191.25 + 0.25 * channel):02x}" for channel in channels)


def label_end(axes: Axes, x: float, y: float, text: str, color: str) -> None:
    """Direct label right of a line's last point."""
    axes.annotate(text, (x, y), xytext=(4, 0), textcoords="offset points", color=color, va="center", fontsize=8)
