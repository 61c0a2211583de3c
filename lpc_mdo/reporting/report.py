"""The report of a run or study folder: figures and one self-contained report.html, from stored results alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO, StringIO
from pathlib import Path
from types import ModuleType
from typing import Any

from matplotlib.figure import Figure
from scipy.spatial import QhullError

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import write_atomically
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.reporting import style
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


@dataclass(frozen=True)
class Drawing:
    """A figure as a page takes it, and its files: contents by the format, SVG always among them."""

    figure: DrawnFigure
    files: dict[str, bytes]


def draw(stored: Any, name: str, formats: Sequence[str]) -> Drawing:
    """Draw a figure of a stored run or study. Raises ConfigurationError where what is stored cannot be drawn."""
    module = figure_module(name)
    with style.look():
        try:
            figure = style.without_mathematics(module.draw(stored))
            text = StringIO()
            figure.savefig(text, format="svg", dpi=RESOLUTION, metadata={"Date": None, "Title": module.TITLE})
            files = {"svg": text.getvalue().encode()}
            for format in formats:
                if format != "svg":
                    files[format] = _bytes_of(figure, format)
        except (ValueError, ArithmeticError, LookupError, TypeError, QhullError) as error:
            reason = str(error).partition("\n")[0]
            raise ConfigurationError(
                f"{stored.folder}: the figure {name} cannot be drawn from it: {reason}."
            ) from error
    return Drawing(DrawnFigure(name, module.TITLE, module.CAPTION, text.getvalue()), files)


def _bytes_of(figure: Figure, format: str) -> bytes:
    stream = BytesIO()
    figure.savefig(stream, format=format, dpi=RESOLUTION)
    return stream.getvalue()


def require_report_folder(folder: Path) -> None:
    """Raises ConfigurationError if the folder holds neither a run nor a study, before anything is written there."""
    if not folder.is_dir():
        raise ConfigurationError(f"{folder} is not allowed; it must be the folder of a run or a study.")
    if not any((folder / name).exists() for name in (STUDY_FILE, "result.json")):
        raise ConfigurationError(f"{folder / 'result.json'}: cannot be read: No such file or directory.")


@one_thread()
def write_report(folder: Path, formats: Sequence[str] = ("svg",)) -> Path:
    """Draw every figure that the folder has data for, and write its report.html; returns its path.

    Nothing is computed anew, and nothing is written before all is drawn. Raises ConfigurationError if the folder holds
    neither a run nor a study, or damaged files.
    """
    require_report_folder(folder)
    if (folder / STUDY_FILE).exists():
        study = read_study(folder)
        names = [name for name in STUDY_FIGURES if figure_module(name).is_drawable(study)]
        drawings = [draw(study, name, formats) for name in names]
        text = study_page(study.content, [drawing.figure for drawing in drawings])
        return _write(folder, drawings, text)
    run = read_run(folder)
    sections = {
        section: [draw(run, name, formats) for name in names if is_drawable(run, figure_module(name))]
        for section, names in FIGURES.items()
    }
    shown = {name: [drawing.figure for drawing in found] for name, found in sections.items() if found}
    return _write(folder, [drawing for found in sections.values() for drawing in found], page(run, shown))


def _write(folder: Path, drawings: Sequence[Drawing], page_text: str) -> Path:
    """The figures' files and the page; returns its path."""
    figures = folder / "figures"
    figures.mkdir(exist_ok=True)
    for drawing in drawings:
        for format, content in drawing.files.items():
            write_atomically(figures / f"{drawing.figure.name}.{format}", content)
    file = folder / "report.html"
    write_atomically(file, page_text)
    return file
