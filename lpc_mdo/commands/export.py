"""`lpc-mdo export`: models for other programs."""

from pathlib import Path

import click

from lpc_mdo.commands.options import RUNS, output_option


@click.group("export")
def command() -> None:
    """Write models for other programs."""


@command.command("geometry")
@click.argument("source", required=False, type=click.Path(path_type=Path))
@click.option("--format", "file_format", type=click.Choice(["step", "stl", "vtk", "png"]), required=True)
@output_option("geometry", "the files")
def geometry(source: Path | None, file_format: str, output: Path | None) -> None:
    """Write the outer mold line of SOURCE: a result.json (before and after) or a vehicle file (default: the shipped one).

    STEP needs the CAD kernel: pip install 'lpc-mdo[cad]'. PNG draws the shape with its measures in several views.
    """
    from lpc_mdo.interop.shape_files import export_shape

    for file in export_shape(source, file_format, output or RUNS / "geometry"):
        click.echo(f"wrote {file}")


@command.command("nastran")
@click.option("--samples", default="baseline", show_default=True, help="Ids of the shipped samples that start so.")
@click.option("--solution", type=click.Choice(["101", "200"]), default="200", show_default=True)
@output_option("nastran", "one deck a sample, and design.csv")
def nastran(samples: str, solution: str, output: Path | None) -> None:
    """Write NASTRAN decks of shipped structural samples: SOL 101 as sized, SOL 200 for NASTRAN to size."""
    from lpc_mdo.files.write import locked
    from lpc_mdo.training.structures_command import export_decks

    folder = output or RUNS / "nastran"
    with locked(folder):
        export_decks(samples, int(solution), folder)
