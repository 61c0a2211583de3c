"""Retrain the airfoil surrogate from the shipped XFOIL polars, or from new ones, and print how good it is."""

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from training.airfoil import train
from training.polar_data import generate, read


@click.command()
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder for data and weights.")
@click.option("--airfoil", default="4412", show_default=True, help="NACA four-digit section.")
@click.option("--generate", "is_generating", is_flag=True, help="Run XFOIL anew instead of reading shipped polars.")
@click.option("--jobs", default=2, show_default=True, help="XFOIL runs at a time.")
@click.option("--seed", default=0, show_default=True)
def main(output: Path, airfoil: str, is_generating: bool, jobs: int, seed: int) -> None:
    source = Path(__file__).parents[1] / "training" / "data"
    if is_generating:
        generate(airfoil, output, jobs)
        source = output
    table = Table("attached range", "points", "cl mean", "cl max", "cd mean %", "cd max %")
    for name, row in train(read(source, airfoil), f"naca{airfoil}", seed, output).items():
        cells = [row["cl_mean"], row["cl_max"], 100 * row["cd_mean_relative"], 100 * row["cd_max_relative"]]
        table.add_row(name, str(row["points"]), *(f"{cell:.4f}" for cell in cells))
    Console().print(table)


if __name__ == "__main__":
    main()
