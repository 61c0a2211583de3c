"""What `lpc-mdo train airfoil` does: polars from XFOIL, from the package or from a file, fit, judgement, figures."""

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from surrogates.airfoil import load_airfoil
from training import neuralfoil
from training.airfoil import train
from training.airfoil_shape import AirfoilShape, airfoil_shape
from training.figures.airfoil_errors import airfoil_error_figure
from training.figures.airfoil_polars import airfoil_polar_figure
from training.polar_data import generate, read

SHIPPED = Path(__file__).parent / "data"


@dataclass(frozen=True)
class AirfoilRequest:
    """airfoil: a NACA designation or a coordinate file; data: polars to use instead of shipped ones or XFOIL's."""

    airfoil: str
    data: Path | None
    is_generating: bool
    output: Path
    jobs: int
    seed: int


def train_airfoil(request: AirfoilRequest, console: Console | None = None) -> None:
    """Write data (if XFOIL ran), weights, card and figures into the output folder and print how good they are.

    Raises ValueError for bad input, or if XFOIL is needed and cannot run.
    """
    console = console or Console()
    shape = airfoil_shape(request.airfoil)
    if request.output.exists() and not request.output.is_dir():
        raise ValueError(f"output = {request.output} is not allowed; it exists and is not a folder")
    file = _polars(request, shape)
    data = read(file)
    console.print(f"{len(data.cl)} points of {shape.name} from {file}")
    table = train(data, shape.name, shape.thickness_to_chord, request.seed, request.output)
    console.print(_error_table(table))
    card = request.output / f"{shape.name}.json"
    polar = load_airfoil(str(card))
    if neuralfoil.is_installed():
        for part in comparison_tables(neuralfoil.compare(polar, shape, data, request.seed)):
            console.print(part)
    else:
        console.print("NeuralFoil is not installed: no comparison with it (pip install 'lpc-mdo[bench]')")
    for name, figure in (("polars", airfoil_polar_figure), ("errors", airfoil_error_figure)):
        image = request.output / f"{shape.name}_{name}.png"
        figure(polar, data).savefig(image, dpi=110)
        console.print(f"wrote {image}")
    console.print(f"wrote {card}; lpc_mdo loads it as load_airfoil({str(card)!r})")


def _polars(request: AirfoilRequest, shape: AirfoilShape) -> Path:
    """The table of polars: the user's, the shipped one of this section, or XFOIL's."""
    if request.data is not None:
        if request.is_generating:
            raise ValueError("--data and --generate are not allowed together")
        return request.data
    shipped = SHIPPED / f"{shape.name}.csv.gz"
    if shape.designation and shipped.is_file() and not request.is_generating:
        return shipped
    return generate(shape, request.output, request.jobs)


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
