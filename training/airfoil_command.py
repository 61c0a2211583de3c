"""What `lpc-mdo train airfoil` does: polars from XFOIL, from the package or from a file, fit, judgement, figures."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from lpc_mdo.airfoils.shape import AirfoilShape, airfoil_shape
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.reporting.style import save
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.training import neuralfoil
from lpc_mdo.training.airfoil import same_lift_mach, train
from lpc_mdo.training.figures.airfoil_errors import airfoil_error_figure
from lpc_mdo.training.figures.airfoil_polars import airfoil_polar_figure
from lpc_mdo.training.polar_data import Grid, generate, read

SHIPPED = Path(__file__).parent / "data"


@dataclass(frozen=True)
class AirfoilRequest:
    """airfoil: a NACA designation, a shipped section or a coordinate file; data: polars to use instead of shipped ones or
    XFOIL's; reynolds, mach: between which numbers of the grid XFOIL runs, everywhere by default."""

    airfoil: str
    data: Path | None
    is_generating: bool
    output: Path
    jobs: int
    seed: int
    reynolds: tuple[float, float] | None = None
    mach: tuple[float, float] | None = None


@one_thread()
def train_airfoil(request: AirfoilRequest, console: Console | None = None) -> Path:
    """Write data (if XFOIL ran), weights, card and figures into the output folder and print how good they are; returns
    the card.

    Raises ValueError for bad input, or if XFOIL is needed and cannot run.
    """
    console = console or terminal()
    shape = airfoil_shape(request.airfoil)
    if request.output.exists() and not request.output.is_dir():
        raise ValueError(f"output = {request.output} is not allowed; it exists and is not a folder")
    for note in shape.notes:
        console.print(f"{request.airfoil}: {note}", markup=False)
    file = _polars(request, shape)
    data = read(file)
    for note in data.notes:
        console.print(f"{file}: {note}", markup=False)
    console.print(f"{len(data.cl)} points of {shape.name} from {file}", markup=False)
    if np.ptp(data.mach) == 0.0:
        low, high = same_lift_mach(float(data.mach[0]))
        console.print(
            f"{file}: every polar is at Mach {data.mach[0]:g}; taken as it is between {low:.3g} and {high:.3g}, where "
            "compressibility changes lift by at most 1 %; beyond, it counts as extrapolated",
            markup=False,
        )
    table = train(data, shape, request.seed, request.output)
    console.print(_error_table(table))
    card = request.output / f"{shape.name}.json"
    polar = load_airfoil(str(card))
    if neuralfoil.is_installed() and bool((data.mach == 0.0).any()):
        for part in comparison_tables(neuralfoil.compare(polar, shape, data, request.seed)):
            console.print(part)
    else:
        why = "no polar is at Mach 0" if neuralfoil.is_installed() else "not installed (pip install 'lpc-mdo[bench]')"
        console.print(f"no comparison with NeuralFoil: {why}", markup=False)
    for name, figure in (("polars", airfoil_polar_figure), ("errors", airfoil_error_figure)):
        image = request.output / f"{shape.name}_{name}.png"
        save(figure(polar, data), image, dpi=110)
        console.print(f"wrote {image}", markup=False)
    console.print(f"wrote {card}; lpc_mdo loads it as load_airfoil({str(card)!r})", markup=False)
    return card


def _polars(request: AirfoilRequest, shape: AirfoilShape) -> Path:
    """The table of polars: the user's, the shipped one of this section, or XFOIL's."""
    is_grid_given = request.reynolds is not None or request.mach is not None
    if request.data is not None:
        if request.is_generating or is_grid_given:
            raise ValueError("--data is invalid with --generate, --reynolds or --mach: they are for XFOIL's polars")
        return request.data
    if _is_shipped(shape) and not request.is_generating:
        if is_grid_given:
            raise ValueError(
                f"--reynolds and --mach are invalid without --generate: polars of {shape.name} are shipped"
            )
        return SHIPPED / f"{shape.name}.csv.gz"
    everything = (0.0, float("inf"))
    grid = Grid().within(request.reynolds or everything, request.mach or everything)
    # In a folder of its own: the card of the data has the name of the surrogate's.
    return generate(shape, request.output / "data", request.jobs, grid)


def _is_shipped(shape: AirfoilShape) -> bool:
    card = SHIPPED / f"{shape.name}.json"
    if not card.is_file():
        return False
    stored = json.loads(card.read_text(encoding="utf-8"))
    return tuple(map(tuple, stored["coordinates"])) == shape.coordinates


def _error_table(rows: dict[str, dict[str, float]]) -> Table:
    table = Table("attached range", "points", "cl mean", "cl max", "cd mean %", "cd max %", title="against the polars")
    for name, row in rows.items():
        table.add_row(name, *_cells(row))
    return table


def _cells(row: dict[str, float]) -> list[str]:
    lift = f"{row['cl_mean']:.4f}", f"{row['cl_max']:.4f}"
    drag = f"{100.0 * row['cd_mean_relative']:.2f}", f"{100.0 * row['cd_max_relative']:.2f}"
    return [str(row["points"]), *lift, *drag]


def comparison_tables(comparison: neuralfoil.Comparison) -> list[Table]:
    """Accuracy and speed beside NeuralFoil, to print."""
    errors = Table("points", "model", "n", "cl mean", "cl max", "cd mean %", "cd max %", title="same points, Mach 0")
    for points, models in comparison.figures.items():
        for model, row in models.items():
            errors.add_row(points, model, *_cells(row))
    speed = Table("model", "evaluations per second", title=f"batches of {neuralfoil.BATCH}")
    for model, figure in comparison.speed.items():
        speed.add_row(model, f"{figure:,.0f}")
    return [errors, speed]
