"""`lpc-mdo analyze`: one discipline, JSON in, JSON out."""

from pathlib import Path

import click


@click.command("analyze")
@click.argument(
    "discipline", type=click.Choice(["airfoil", "rotor", "wing", "noise", "motor", "battery", "structures"])
)
@click.argument("case", type=click.Path(path_type=Path))
def command(discipline: str, case: Path) -> None:
    """Evaluate one discipline for a CASE file (JSON) and print the results as JSON."""
    if discipline == "structures":
        from lpc_mdo.cases.structures import analyze_file as analyze_frame_file

        click.echo(analyze_frame_file(case))
    else:
        from lpc_mdo.cases import analyze_file

        click.echo(analyze_file(discipline, case))
