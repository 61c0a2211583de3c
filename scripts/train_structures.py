"""Retrain the structural mass surrogate from the stored samples, from new ones, or from a user's table."""

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from training.samples import read_samples
from training.structures import OPEN_SOURCE, generate, read_open, train


@click.command()
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder for data and weights.")
@click.option("--generate", "is_generating", is_flag=True, help="Size all samples anew instead of reading stored ones.")
@click.option("--samples", type=click.Path(path_type=Path, exists=True), help="Your own table (CSV): source nastran.")
@click.option("--jobs", default=2, show_default=True, help="Parts sized at a time.")
@click.option("--seed", default=0, show_default=True)
def main(output: Path, is_generating: bool, samples: Path | None, jobs: int, seed: int) -> None:
    if samples is not None:
        card = train(*read_samples(samples), "nastran", f"user's table {samples.name}", output, seed)
    else:
        if is_generating:
            generate(output, seed, jobs)
        folder = output if is_generating else Path(__file__).parents[1] / "training" / "data"
        card = train(*read_open(folder), "open", OPEN_SOURCE, output, seed)
    table = Table("component mass", "form", "r2", "r2 cross-validated", "rmse kg", "kg at baseline")
    for name, mass in card["baseline_mass_kg"].items():
        row = card["quality"][f"{name}.mass_kg"]
        held_out = row["r2_cross_validated"][row["form"]]
        cells = (f"{row['r2']:.5f}", f"{held_out:.5f}", f"{row['rmse']:.3g}", f"{mass:.2f}")
        table.add_row(name, row["form"], *cells)
    Console().print(table)
    for sentence in card["samples"]["dropped"]:
        Console().print(f"dropped {sentence}")


if __name__ == "__main__":
    main()
