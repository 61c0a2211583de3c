"""`lpc-mdo init`: the baseline's files to edit."""

from importlib import resources
from pathlib import Path

import click


@click.command("init")
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Copy the baseline vehicle and mission files to FOLDER for editing."""
    if folder.exists() and not folder.is_dir():
        raise click.ClickException(f"{folder} is not allowed; it exists and is not a folder")
    files = {name: folder / name for name in ("vehicle.toml", "mission.toml")}
    if existing := [str(file) for file in files.values() if file.exists()]:
        raise click.ClickException(f"{existing[0]} exists already; nothing was written")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise click.ClickException(f"{folder} is not allowed: {error.strerror}") from None
    for name, file in files.items():
        file.write_text(resources.files("lpc_mdo.data").joinpath(name).read_text(encoding="utf-8"), encoding="utf-8")
        click.echo(f"wrote {file}")
