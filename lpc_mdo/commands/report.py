"""`lpc-mdo report`: figures and report.html of a stored run or study."""

from pathlib import Path

import click


@click.command("report")
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Draw the figures (SVG, PNG) and report.html of a run or study FOLDER; nothing is recomputed."""
    from lpc_mdo.files.write import locked
    from lpc_mdo.reporting.report import require_report_folder, write_report

    require_report_folder(folder)
    with locked(folder):
        click.echo(f"wrote {write_report(folder, formats=('svg', 'png'))}")
