"""The lpc-mdo command: argument parsing only; everything heavy is imported inside the commands."""

import math
import sys
import time
from pathlib import Path

import click

STARTED = time.monotonic()
BAD_INPUT = 2


class _Group(click.Group):
    """Turns every fault of the input into one line on standard error, and exits with code 2."""

    def main(self, *args, **kwargs):
        kwargs["standalone_mode"] = False
        try:
            code = super().main(*args, **kwargs)
        except click.ClickException as error:
            click.echo(f"lpc-mdo: {error.format_message()}", err=True)
            sys.exit(BAD_INPUT)
        except (ValueError, OSError) as error:
            for line in str(error).splitlines():
                click.echo(f"lpc-mdo: {line}", err=True)
            sys.exit(BAD_INPUT)
        except (KeyboardInterrupt, click.Abort):
            click.echo("lpc-mdo: stopped", err=True)
            sys.exit(1)
        sys.exit(code if isinstance(code, int) else 0)


def _a_number(context: click.Context, parameter: click.Parameter, value: float) -> float:
    if math.isnan(value):
        raise click.BadParameter("nan is not a number of seconds; it must be at least 1.")
    return value


@click.group(cls=_Group, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="lpc-mdo", prog_name="lpc-mdo")
def main() -> None:
    """Differentiable design of the Lift+Cruise electric air taxi."""


@main.command()
@click.argument("vehicle", required=False, type=click.Path(path_type=Path))
@click.option("--mission", type=click.Path(path_type=Path), help="Mission file; the shipped one if left out.")
@click.option("--problem", type=click.Choice(["gross-weight"]), default="gross-weight", show_default=True)
@click.option("--formulation", type=click.Choice(["paper"]), default="paper", show_default=True)
@click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="E.g. vehicle.wing.area_m2=18; repeatable."
)
@click.option(
    "--solver",
    type=click.Choice(["augmented-lagrangian", "slsqp", "trust-constr"]),
    default="augmented-lagrangian",
    show_default=True,
)
@click.option("--start", type=click.Path(path_type=Path), help="result.json whose design is the start.")
@click.option("--resume", "is_resuming", is_flag=True, help="Go on from the checkpoint in the output folder.")
@click.option("--quiet", "is_quiet", is_flag=True, help="No progress display.")
@click.option("--time-limit", type=click.FloatRange(min=1.0), default=math.inf, callback=_a_number, help="Seconds.")
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Run folder.")
def optimize(
    vehicle: Path | None,
    mission: Path | None,
    problem: str,
    formulation: str,
    overrides: tuple[str, ...],
    solver: str,
    start: Path | None,
    is_resuming: bool,
    is_quiet: bool,
    time_limit: float,
    output: Path,
) -> int:
    """Optimize VEHICLE (the shipped baseline if left out) and write a run folder.

    Exit code 0: converged; 1: not converged, the result says why; 2: bad input.
    """
    from lpc_mdo import runs

    request = runs.Request(vehicle, mission, overrides, solver, start, is_resuming, is_quiet, time_limit, output)
    return runs.optimize(request, STARTED)


@main.command()
@click.argument("discipline", type=click.Choice(["airfoil", "rotor", "wing", "noise", "motor", "battery"]))
@click.argument("case", type=click.Path(path_type=Path))
def analyze(discipline: str, case: Path) -> None:
    """Evaluate one discipline for a CASE file (JSON) and print the results as JSON."""
    from lpc_mdo.cases import analyze_file

    click.echo(analyze_file(discipline, case))


@main.command()
@click.option("--gradients", "is_every_gradient", is_flag=True, help="Every variable, not one direction; slower.")
def check(is_every_gradient: bool) -> int:
    """Check on this machine: input files, surrogates, the model at the start, and its gradients.

    Exit code 0: all is well; 1: a check failed, the table says which.
    """
    from lpc_mdo.self_check import run_checks

    return run_checks(is_every_gradient)


@main.command()
@click.argument("source", required=False, type=click.Path(path_type=Path))
@click.option("--format", "file_format", type=click.Choice(["step", "stl", "vtk", "png"]), required=True)
@click.option("--output", type=click.Path(path_type=Path), required=True, help="Folder for the files.")
def export(source: Path | None, file_format: str, output: Path) -> None:
    """Write the outer mold line of SOURCE: a result.json (before and after) or a vehicle file (the shipped one).

    STEP needs the CAD kernel: pip install 'lpc-mdo[cad]'. PNG draws the shape with its measures in several views.
    """
    from lpc_mdo.export import export_shape

    for file in export_shape(source, file_format, output):
        click.echo(f"wrote {file}")


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
def init(folder: Path) -> None:
    """Copy the baseline vehicle and mission files to FOLDER for editing."""
    from importlib import resources

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
