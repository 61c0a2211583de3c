"""The lpc-mdo command: argument parsing only; everything heavy is imported inside the commands."""

import contextlib
import errno
import math
import os
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from lpc_mdo.study_commands import (
    RUNS,
    hover_case,
    output_option,
    pareto,
    scattering,
    solver_option,
    starts_options,
    sweep,
)

STARTED = time.monotonic()
FAILED, BAD_INPUT = 1, 2


class _Group(click.Group):
    """Turns every fault of the input into one line on standard error and exit code 2; of the machine, exit code 1."""

    def main(self, *args, **kwargs):
        kwargs["standalone_mode"] = False
        warnings.formatwarning = _each_once()
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a terminal without some sign shows "?"
        try:
            code = super().main(*args, **kwargs)
        except click.ClickException as error:
            code = _refused(BAD_INPUT, error.format_message())
        except OSError as error:
            code = _failed(error)
        except ValueError as error:
            code = _refused(BAD_INPUT, str(error))
        except MemoryError:
            code = _refused(FAILED, "the memory of this machine does not suffice")
        except (KeyboardInterrupt, click.Abort):
            code = _refused(FAILED, "stopped")
        _let_go_of_output()
        sys.exit(code if isinstance(code, int) else 0)


def _refused(code: int, text: str) -> int:
    with contextlib.suppress(OSError):  # nobody reads it
        for line in text.splitlines():
            click.echo(f"lpc-mdo: {line}", err=True)
    return code


def _failed(error: OSError) -> int:
    """A file that is not what it should be is bad input; a full disk or a lost connection is not."""
    from lpc_mdo.reporting.files import is_of_the_machine

    if not is_of_the_machine(error):
        return _refused(BAD_INPUT, str(error))
    if error.errno == errno.EPIPE:  # who reads our output has seen enough
        return FAILED
    place = f"{error.filename}: " if error.filename else ""
    return _refused(FAILED, f"{place}{error.strerror or error}")


def _let_go_of_output() -> None:
    """Write what is left; where nobody takes it, leave nothing for Python to complain of at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _each_once() -> Callable[..., str]:
    """Formats a warning as one line, the same text again as nothing: Python forgets what it showed when filters change."""
    told: set[str] = set()

    def line(message: Warning | str, *details: object) -> str:
        is_new = str(message) not in told
        told.add(str(message))
        return f"lpc-mdo: {message}\n" if is_new else ""

    return line


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
@click.option(
    "--problem", type=click.Choice(["gross-weight", "aeroacoustic"]), default="gross-weight", show_default=True
)
@click.option("--noise-weight", type=float, help="Aeroacoustic: 0 efficiency alone ... 1 noise alone; 0.5 if left out.")
@click.option("--observer-distance-ft", type=float, help="Aeroacoustic; 250 if left out.")
@click.option("--observer-angle-deg", type=float, help="Aeroacoustic, from the disk plane; 45 if left out.")
@click.option(
    "--formulation",
    type=click.Choice(["paper", "reduced"]),
    default="paper",
    show_default=True,
    help="Reduced: mirrored rotors are one variable; same optimum, sooner.",
)
@click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="E.g. vehicle.wing.area_m2=18; repeatable."
)
@solver_option("augmented-lagrangian")
@click.option("--start", type=click.Path(path_type=Path), help="result.json whose design is the start.")
@click.option("--resume", "is_resuming", is_flag=True, help="Go on from the checkpoint in the output folder.")
@click.option("--quiet", "is_quiet", is_flag=True, help="No progress display.")
@click.option("--verbose", "is_verbose", is_flag=True, help="Inner iterations, step lengths and active sets, too.")
@click.option("--time-limit", type=click.FloatRange(min=1.0), default=math.inf, callback=_a_number, help="Seconds.")
@starts_options
@output_option(
    "NAME", "NAME is the vehicle file's or, where that is vehicle.toml, its folder's; baseline for the shipped one"
)
def optimize(
    vehicle: Path | None,
    mission: Path | None,
    problem: str,
    noise_weight: float | None,
    observer_distance_ft: float | None,
    observer_angle_deg: float | None,
    formulation: str,
    overrides: tuple[str, ...],
    solver: str,
    start: Path | None,
    is_resuming: bool,
    is_quiet: bool,
    is_verbose: bool,
    time_limit: float,
    output: Path | None,
    **scatter: Any,
) -> int:
    """Optimize VEHICLE (the shipped baseline if left out) and write a run folder.

    With --starts N from N designs scattered around the baseline: a table and a plot show where they end, and the best is
    the result.

    Exit code 0: converged; 1: not converged, the result says why, or stopped, or not all could be written; 2: bad input.
    """
    from lpc_mdo import runs

    blades = hover_case(problem, noise_weight, observer_distance_ft, observer_angle_deg)
    request = runs.Request(
        vehicle,
        mission,
        overrides,
        solver,
        start,
        is_resuming,
        is_quiet,
        time_limit,
        output or RUNS / _run_name(vehicle, problem, scatter["starts"] is not None),
        blades,
        is_reduced=formulation == "reduced",
        is_verbose=is_verbose,
    )
    if (scattered := scattering(**scatter)) is None:
        return runs.run_request(request, STARTED)
    from lpc_mdo import multi_start

    return multi_start.optimize(request, scattered, STARTED)


def _run_name(vehicle: Path | None, problem: str, is_scattered: bool) -> str:
    """The folder's name where --output gives none."""
    name = "baseline"
    if vehicle is not None:
        name = vehicle.stem if vehicle.stem != "vehicle" else vehicle.resolve().parent.name
    return name + ("-aeroacoustic" if problem == "aeroacoustic" else "") + ("-starts" if is_scattered else "")


main.add_command(pareto)
main.add_command(sweep)


@main.command()
@click.argument(
    "discipline", type=click.Choice(["airfoil", "rotor", "wing", "noise", "motor", "battery", "structures"])
)
@click.argument("case", type=click.Path(path_type=Path))
def analyze(discipline: str, case: Path) -> None:
    """Evaluate one discipline for a CASE file (JSON) and print the results as JSON."""
    if discipline == "structures":
        from lpc_mdo.cases.structures import analyze_file as analyze_frame_file

        click.echo(analyze_frame_file(case))
    else:
        from lpc_mdo.cases import analyze_file

        click.echo(analyze_file(discipline, case))


@main.command()
@click.argument("folder", type=click.Path(path_type=Path))
def report(folder: Path) -> None:
    """Draw the figures (SVG, PNG) and report.html of a run or study FOLDER; nothing is recomputed."""
    from lpc_mdo.reporting.files import locked
    from lpc_mdo.reporting.report import require_report_folder, write_report

    require_report_folder(folder)
    with locked(folder):
        click.echo(f"wrote {write_report(folder, formats=('svg', 'png'))}")


@main.command()
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--verify", "is_verifying", is_flag=True, help="Optimize again with 1 % less and more; a minute or so.")
@click.option("--of", "labels", multiple=True, help="With --verify: what to change, as the table calls it; repeatable.")
def sensitivities(run: Path, is_verifying: bool, labels: tuple[str, ...]) -> int:
    """Show what the optimum in the run folder RUN answers to, for one per cent more of limits, bounds and parameters.

    With --verify, optima found anew stand beside what the envelope theorem says, also in RUN/sensitivities.json.
    Exit code 0: done; 1: an optimum could not be certified; 2: bad input.
    """
    from lpc_mdo import sensitivity_command

    if labels and not is_verifying:
        raise click.UsageError("--of is not allowed without --verify; the table shows everything.")
    return sensitivity_command.verify(run, labels) if is_verifying else sensitivity_command.show(run)


@main.command()
@click.option("--gradients", "is_every_gradient", is_flag=True, help="Every variable, not one direction; slower.")
@click.option("--full", "is_full", is_flag=True, help="Every model against other codes, theory and experiments, too.")
@click.option(
    "--random-conditions",
    type=click.IntRange(1, 100_000_000),
    default=1_000_000,
    show_default=True,
    help="With --full: rotors at random; a million takes two minutes.",
)
@output_option("verification", "with --full: page, pictures and comparisons")
@click.option(
    "--publish", "is_published", is_flag=True, help="With --full: renew the source tree's page and data instead."
)
def check(
    is_every_gradient: bool, is_full: bool, random_conditions: int, output: Path | None, is_published: bool
) -> int:
    """Check on this machine: input files, surrogates, the model at the start, and its gradients.

    Exit code 0: all is well; 1: a check failed or a comparison missed its limit, the table says which.
    """
    for option, is_given in (("--output", output is not None), ("--publish", is_published)):
        if is_given and not is_full:
            raise click.UsageError(f"{option} needs --full")
    if output is not None and is_published:
        raise click.UsageError("--output and --publish exclude each other")
    from lpc_mdo.self_check import run_checks

    code = run_checks(is_every_gradient)
    if is_full:
        from lpc_mdo.full_check import run_full_check

        code = max(code, run_full_check(random_conditions, None if is_published else output or RUNS / "verification"))
    return code


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


@main.group()
def train() -> None:
    """Retrain a surrogate from shipped data or your own."""


@train.command("structures")
@click.option("--data", type=click.Path(path_type=Path), help="Your own table of samples (.csv, .csv.gz).")
@click.option(
    "--generate", "is_generating", is_flag=True, help="Size all samples anew instead of reading shipped ones."
)
@click.option("--jobs", type=click.IntRange(1, 256), default=2, show_default=True, help="Parts sized at a time.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@output_option("structures", "data, weights, card and figures")
def train_structures(data: Path | None, is_generating: bool, jobs: int, seed: int, output: Path | None) -> None:
    """Fit structural mass to sized samples, ours or your own, and print how good the fit is."""
    from lpc_mdo.reporting.files import locked
    from lpc_mdo.training.structures_command import StructuresRequest, train_structures

    folder = output or RUNS / "structures"
    with locked(folder):
        train_structures(StructuresRequest(data, is_generating, jobs, seed, folder))


@train.command("airfoil")
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
@click.option("--jobs", type=click.IntRange(1, 256), default=2, show_default=True, help="XFOIL runs at a time.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@output_option("AIRFOIL", "data, weights, card and figures")
def train_airfoil(
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
    from lpc_mdo.reporting.files import locked
    from lpc_mdo.training.airfoil_command import AirfoilRequest, train_airfoil

    folder = output or RUNS / (Path(airfoil).stem or "airfoil")
    with locked(folder):
        train_airfoil(AirfoilRequest(airfoil, data, is_generating, folder, jobs, seed, reynolds, mach))


@main.group()
def export() -> None:
    """Write models for other programs."""


@export.command("geometry")
@click.argument("source", required=False, type=click.Path(path_type=Path))
@click.option("--format", "file_format", type=click.Choice(["step", "stl", "vtk", "png"]), required=True)
@output_option("geometry", "the files")
def export_geometry(source: Path | None, file_format: str, output: Path | None) -> None:
    """Write the outer mold line of SOURCE: a result.json (before and after) or a vehicle file (the shipped one).

    STEP needs the CAD kernel: pip install 'lpc-mdo[cad]'. PNG draws the shape with its measures in several views.
    """
    from lpc_mdo.export import export_shape

    for file in export_shape(source, file_format, output or RUNS / "geometry"):
        click.echo(f"wrote {file}")


@export.command("nastran")
@click.option("--samples", default="baseline", show_default=True, help="Ids of the shipped samples that start so.")
@click.option("--solution", type=click.Choice(["101", "200"]), default="200", show_default=True)
@output_option("nastran", "one deck a sample, and design.csv")
def export_nastran(samples: str, solution: str, output: Path | None) -> None:
    """Write NASTRAN decks of shipped structural samples: SOL 101 as sized, SOL 200 for NASTRAN to size."""
    from lpc_mdo.reporting.files import locked
    from lpc_mdo.training.structures_command import export_decks

    folder = output or RUNS / "nastran"
    with locked(folder):
        export_decks(samples, int(solution), folder)


if __name__ == "__main__":
    main()
