"""The report of a run folder: figures/*.svg and one self-contained report.html, from stored results alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import ModuleType

from lpc_mdo.reporting import style
from lpc_mdo.reporting.files import write_atomically
from lpc_mdo.reporting.html import page
from lpc_mdo.reporting.stored import StoredRun, read_run

FIGURES = {
    "The aircraft": ("overview", "weight_breakdown", "planform", "drag_polar"),
    "Rotors": ("blade_shapes", "rotor_efficiency"),
    "The mission": ("mission_profile", "mission_energy"),
    "The optimization": ("sensitivities", "convergence", "constraint_history", "design_structure_matrix"),
}
"""Sections of the report and their figures, modules of `lpc_mdo.reporting.figures`."""

RESOLUTION = 150  # dots per inch of PNG files


@dataclass(frozen=True)
class DrawnFigure:
    """A figure as text, ready for a page."""

    name: str
    title: str
    caption: str
    svg: str


def figure_module(name: str) -> ModuleType:
    return import_module(f"lpc_mdo.reporting.figures.{name}")


def is_drawable(run: StoredRun, module: ModuleType) -> bool:
    """The run stored what the figure needs: a problem without a wing has no drag polar."""
    present = {*run.optimized, *run.optimized.get("summary", {})}
    present |= {name for name, content in run.analysis.items() if content}
    present |= {name for name in ("history", "evaluations") if getattr(run, name)}
    return set(module.NEEDS) <= present


def draw(run: StoredRun, name: str, formats: Sequence[str]) -> DrawnFigure:
    """Draw one figure into the run's `figures` folder in the given formats, of which SVG is always one."""
    module = figure_module(name)
    folder = run.folder / "figures"
    with style.look():
        figure = module.draw(run)
        text = StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Title": module.TITLE})
        write_atomically(folder / f"{name}.svg", text.getvalue())
        for format in formats:
            if format != "svg":
                figure.savefig(folder / f"{name}.{format}", dpi=RESOLUTION)
    return DrawnFigure(name, module.TITLE, module.CAPTION, text.getvalue())


def write_report(folder: Path, formats: Sequence[str] = ("svg",)) -> Path:
    """Draw every figure that the run in `folder` has data for, and write report.html; returns its path.

    Nothing is computed anew. Raises ConfigurationError if the folder is no run folder or a file of it is damaged.
    """
    run = read_run(folder)
    (folder / "figures").mkdir(exist_ok=True)
    sections = {
        section: [draw(run, name, formats) for name in names if is_drawable(run, figure_module(name))]
        for section, names in FIGURES.items()
    }
    file = folder / "report.html"
    write_atomically(file, page(run, {name: figures for name, figures in sections.items() if figures}))
    return file
