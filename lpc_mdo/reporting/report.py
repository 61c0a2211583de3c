"""The report of a run or study folder: figures and one self-contained report.html, from stored results alone."""

from collections.abc import Sequence
from importlib import import_module
from io import StringIO
from pathlib import Path
from types import ModuleType
from typing import Any

from lpc_mdo.reporting import style
from lpc_mdo.reporting.files import write_atomically
from lpc_mdo.reporting.html import DrawnFigure, page, study_page
from lpc_mdo.reporting.stored import STUDY_FILE, StoredRun, read_run, read_study

FIGURES = {
    "The aircraft": (
        "overview",
        "outer_mold_line",
        "geometry_measures",
        "planform",
        "weight_breakdown",
        "drag_polar",
    ),
    "Rotors and motors": ("blade_shapes", "blade_loading", "rotor_efficiency", "motor_efficiency_map"),
    "Noise": ("directivity", "spectrum", "noise_contour"),
    "The mission": ("mission_profile", "mission_energy"),
    "Models": ("surrogate_samples",),
    "The optimization": ("sensitivities", "convergence", "constraint_history", "design_structure_matrix"),
}
"""Sections of a run's report and their figures, modules of `lpc_mdo.reporting.figures`."""

STUDY_FIGURES = ("study_points", "study_blades")
RESOLUTION = 150  # dots per inch of PNG files, and of what is painted as pixels in SVG files


def figure_module(name: str) -> ModuleType:
    return import_module(f"lpc_mdo.reporting.figures.{name}")


def is_drawable(run: StoredRun, module: ModuleType) -> bool:
    """The run stored what the figure needs: a problem without a wing has no drag polar."""
    present = {*run.optimized, *run.optimized.get("summary", {}), *run.optimized.get("noise", {})}
    present |= {name for name, content in run.analysis.items() if content}
    present |= {name for name in ("history", "evaluations") if getattr(run, name)}
    return set(module.NEEDS) <= present


def draw(stored: Any, name: str, formats: Sequence[str]) -> DrawnFigure:
    """Draw a figure of a stored run or study into its `figures` folder; of the formats, SVG is always one."""
    module = figure_module(name)
    folder = stored.folder / "figures"
    with style.look():
        figure = module.draw(stored)
        text = StringIO()
        figure.savefig(text, format="svg", dpi=RESOLUTION, metadata={"Date": None, "Title": module.TITLE})
        write_atomically(folder / f"{name}.svg", text.getvalue())
        for format in formats:
            if format != "svg":
                figure.savefig(folder / f"{name}.{format}", dpi=RESOLUTION)
    return DrawnFigure(name, module.TITLE, module.CAPTION, text.getvalue())


def write_report(folder: Path, formats: Sequence[str] = ("svg",)) -> Path:
    """Draw every figure that the folder has data for, and write its report.html; returns its path.

    Nothing is computed anew. Raises ConfigurationError if the folder holds neither a run nor a study, or damaged files.
    """
    file = folder / "report.html"
    if (folder / STUDY_FILE).exists():
        study = read_study(folder)
        (folder / "figures").mkdir(exist_ok=True)
        names = [name for name in STUDY_FIGURES if figure_module(name).is_drawable(study)]
        write_atomically(file, study_page(study.content, [draw(study, name, formats) for name in names]))
        return file
    run = read_run(folder)
    (folder / "figures").mkdir(exist_ok=True)
    sections = {
        section: [draw(run, name, formats) for name in names if is_drawable(run, figure_module(name))]
        for section, names in FIGURES.items()
    }
    write_atomically(file, page(run, {name: figures for name, figures in sections.items() if figures}))
    return file
