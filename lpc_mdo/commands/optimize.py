"""`lpc-mdo optimize`: one optimum and its run folder, or many scattered starts and the best of them."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lpc_mdo.commands import STARTED
from lpc_mdo.commands.options import MOST_JOBS, RUNS, applied, input_options, observer, output_option, solver_option

if TYPE_CHECKING:
    from lpc_mdo.problems.choice import Case
    from lpc_mdo.studies.multi_start import Scattering

MOST_STARTS = 10_000


def _a_number(context: click.Context, parameter: click.Parameter, value: float) -> float:
    if math.isnan(value):
        raise click.BadParameter("nan is not a number of seconds; it must be at least 1.")
    return value


def _problem_options(command: Callable[..., Any]) -> Callable[..., Any]:
    options = [
        click.option(
            "--problem",
            default="gross-weight",
            show_default=True,
            metavar="NAME|FILE",
            help="gross-weight, full-envelope, aeroacoustic, or a problem file: docs/own-problem.md.",
        ),
        click.option(
            "--noise-weight", type=float, help="Aeroacoustic: 0 efficiency alone ... 1 noise alone; default: 0.5."
        ),
        click.option("--observer-distance-ft", type=float, help="Aeroacoustic; default: 250."),
        click.option("--observer-angle-deg", type=float, help="Aeroacoustic, from the disk plane; default: 45."),
        click.option(
            "--formulation",
            type=click.Choice(["paper", "reduced"]),
            default="paper",
            show_default=True,
            help="Reduced: mirrored rotors are one variable; same optimum, sooner.",
        ),
    ]
    return applied(options, command)


def _starts_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of scattered starts; they reach the command as the four of `_scattering`."""
    options = [
        click.option("--starts", type=click.IntRange(2, MOST_STARTS), help="Optimize from so many scattered starts."),
        click.option("--seed", type=click.IntRange(min=0), help="Of the scatter; default: 0."),
        click.option("--reach", type=float, help="Of the scatter, as a share of every variable's range; default: 0.1."),
        click.option("--jobs", type=click.IntRange(1, MOST_JOBS), help="Processes for the starts; default: 1."),
    ]
    return applied(options, command)


FULL_ENVELOPE = "full-envelope"


@click.command("optimize")
@input_options
@_problem_options
@solver_option(None)
@click.option("--start", type=click.Path(path_type=Path), help="result.json whose design is the start.")
@click.option("--resume", "is_resuming", is_flag=True, help="Go on from the checkpoint in the output folder.")
@click.option("--quiet", "is_quiet", is_flag=True, help="No progress display.")
@click.option("--verbose", "is_verbose", is_flag=True, help="Inner iterations, step lengths and active sets, too.")
@click.option("--time-limit", type=click.FloatRange(min=1.0), default=math.inf, callback=_a_number, help="Seconds.")
@_starts_options
@output_option(
    "NAME", "NAME is the vehicle file's or, where that is vehicle.toml, its folder's; baseline for the shipped one"
)
def command(
    vehicle: Path | None,
    mission: Path | None,
    overrides: tuple[str, ...],
    problem: str,
    noise_weight: float | None,
    observer_distance_ft: float | None,
    observer_angle_deg: float | None,
    formulation: str,
    solver: str | None,
    start: Path | None,
    is_resuming: bool,
    is_quiet: bool,
    is_verbose: bool,
    time_limit: float,
    output: Path | None,
    **scatter: Any,
) -> int:
    """Optimize an aircraft and write a run folder. VEHICLE: its file; default: the shipped baseline.

    With --starts N from N designs scattered around the baseline: a table and a plot show where they end, and the best is
    the result.

    Exit code 0: converged; 1: not converged, the result says why, or stopped, or not all could be written; 2: bad input.
    """
    from lpc_mdo.studies.run_request import Request, run_request

    request = Request(
        vehicle,
        mission or _default_mission(problem),
        overrides,
        solver or ("sqp" if scatter["starts"] else "augmented-lagrangian"),  # from far away the fewest evaluations
        start,
        is_resuming,
        is_quiet,
        time_limit,
        output or RUNS / _run_name(vehicle, problem, scatter["starts"] is not None),
        _case(problem, noise_weight, observer_distance_ft, observer_angle_deg),
        is_reduced=formulation == "reduced",
        is_verbose=is_verbose,
    )
    if (scattered := _scattering(**scatter)) is None:
        return run_request(request, STARTED)
    from lpc_mdo.studies import multi_start

    return multi_start.optimize(request, scattered, STARTED)


def _default_mission(problem: str) -> Path | None:
    """The shipped mission of a problem; None: that of the published study."""
    if problem != FULL_ENVELOPE:
        return None
    from lpc_mdo.problems.full_envelope import full_envelope_mission

    return full_envelope_mission()


def _run_name(vehicle: Path | None, problem: str, is_scattered: bool) -> str:
    """The folder's name where --output gives none."""
    name = "baseline"
    if vehicle is not None:
        name = vehicle.stem if vehicle.stem != "vehicle" else vehicle.resolve().parent.name
    return name + ("" if problem == "gross-weight" else f"-{Path(problem).stem}") + ("-starts" if is_scattered else "")


def _case(problem: str, noise_weight: float | None, distance_ft: float | None, angle_deg: float | None) -> "Case":
    """Weights and observer of the aeroacoustic problem, a problem file, None for the gross-weight problem.

    Raises ConfigurationError for values out of range, and for any value with the other problem.
    """
    from lpc_mdo.files.read import ConfigurationError
    from lpc_mdo.problems.aeroacoustic import WeightedSum

    given = {
        "--noise-weight": noise_weight,
        "--observer-distance-ft": distance_ft,
        "--observer-angle-deg": angle_deg,
    }
    if problem not in ("gross-weight", FULL_ENVELOPE, "aeroacoustic") and not problem.endswith(".toml"):
        raise ConfigurationError(
            f"--problem {problem} is invalid: it must be gross-weight, full-envelope, aeroacoustic or a problem file, FILE.toml."
        )
    if problem != "aeroacoustic":
        wrong = [option for option, value in given.items() if value is not None]
        if wrong:
            raise ConfigurationError(f"{wrong[0]} is not allowed with --problem {problem}; it needs aeroacoustic.")
        return Path(problem) if problem.endswith(".toml") else (problem if problem == FULL_ENVELOPE else None)
    return WeightedSum() if noise_weight is None else WeightedSum(noise_weight), observer(distance_ft, angle_deg)


def _scattering(starts: int | None, seed: int | None, reach: float | None, jobs: int | None) -> "Scattering | None":
    """How starts are scattered, None for a single run. Raises ConfigurationError for an option that needs --starts."""
    from lpc_mdo.files.read import ConfigurationError

    if starts is None:
        for option, value in {"--seed": seed, "--reach": reach, "--jobs": jobs}.items():
            if value is not None:
                raise ConfigurationError(f"{option} is not allowed without --starts; a single run has no use for it.")
        return None
    from lpc_mdo.studies.multi_start import Scattering
    from lpc_mdo.studies.starts import REACH

    return Scattering(starts, seed or 0, REACH if reach is None else reach, jobs or 1)
