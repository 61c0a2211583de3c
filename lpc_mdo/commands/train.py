"""`lpc-mdo train`: surrogates from shipped data or the user's own."""

from pathlib import Path

import click

from lpc_mdo.commands.options import MOST_JOBS, RUNS, output_option


@click.group("train")
def command() -> None:
    """Retrain a surrogate from shipped data or your own."""


@command.command("structures")
@click.option("--data", type=click.Path(path_type=Path), help="Your own table of samples (.csv, .csv.gz).")
@click.option(
    "--generate", "is_generating", is_flag=True, help="Size all samples anew instead of reading shipped ones."
)
@click.option("--jobs", type=click.IntRange(1, MOST_JOBS), default=2, show_default=True, help="Parts sized at a time.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@output_option("structures", "data, weights, card and figures")
def structures(data: Path | None, is_generating: bool, jobs: int, seed: int, output: Path | None) -> None:
    """Fit structural mass to sized samples, ours or your own, and print how good the fit is."""
    from lpc_mdo.files.write import locked
    from lpc_mdo.training.structures_command import StructuresRequest, train_structures

    folder = output or RUNS / "structures"
    with locked(folder):
        train_structures(StructuresRequest(data, is_generating, jobs, seed, folder))


@command.command("airfoil")
@click.option(
    "--airfoil",
    default="naca4412",
    show_default=True,
    help="NACA section of four or five digits, ls417, or a coordinate file.",
)
@click.option("--data", type=click.Path(path_type=Path), help="Polars to learn (.csv, .csv.gz) instead of XFOIL's.")
@click.option("--generate", "is_generating", is_flag=True, help="Run XFOIL even where polars are shipped.")
@click.option("--reynolds", nargs=2, type=float, metavar="LOW HIGH", help="Run XFOIL between these alone; 3e4 to 1e7.")
@click.option("--mach", nargs=2, type=float, metavar="LOW HIGH", help="Likewise; 0 to 0.6.")
@click.option("--jobs", type=click.IntRange(1, MOST_JOBS), default=2, show_default=True, help="XFOIL runs at a time.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@output_option("AIRFOIL", "data, weights, card and figures")
def airfoil(
    airfoil: str,
    data: Path | None,
    is_generating: bool,
    reynolds: tuple[float, float] | None,
    mach: tuple[float, float] | None,
    jobs: int,
    seed: int,
    output: Path | None,
) -> None:
    """Fit section lift and drag to polars, from XFOIL or your own, and print how good the fit is.

    A run that was stopped goes on where it was when started again with the same options.
    """
    from lpc_mdo.files.write import locked
    from lpc_mdo.training.airfoil_command import AirfoilRequest, train_airfoil

    folder = output or RUNS / (Path(airfoil).stem or "airfoil")
    with locked(folder):
        train_airfoil(AirfoilRequest(airfoil, data, is_generating, folder, jobs, seed, reynolds, mach))
