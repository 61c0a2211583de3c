"""The commands `pareto` and `sweep`, and the hover case of `optimize`: arguments in, studies out."""

import contextlib
import importlib.util
from collections.abc import Callable
from math import radians
from pathlib import Path
from typing import Any

import click

METRES_PER_FOOT = 0.3048
RUNS = Path("runs")  # where results go unless --output names another folder
MOST_POINTS = 400  # of a front: they are solved in one batch, 4 MB each
MOST_STARTS = 10_000
MOST_VALUES = 1000  # of a sweep


def hover_case(problem: str, noise_weight: float | None, distance_ft: float | None, angle_deg: float | None) -> Any:
    """Weights and observer of the aeroacoustic problem, None for the other one.

    Raises ConfigurationError for values out of range, and for any value with the other problem.
    """
    from lpc_mdo.config import ConfigurationError
    from lpc_mdo.problems.aeroacoustic import WeightedSum

    given = {
        "--noise-weight": noise_weight,
        "--observer-distance-ft": distance_ft,
        "--observer-angle-deg": angle_deg,
    }
    if problem != "aeroacoustic":
        wrong = [option for option, value in given.items() if value is not None]
        if wrong:
            raise ConfigurationError(f"{wrong[0]} is not allowed with --problem {problem}; it needs aeroacoustic.")
        return None
    return WeightedSum() if noise_weight is None else WeightedSum(noise_weight), _observer(distance_ft, angle_deg)


def _observer(distance_ft: float | None, angle_deg: float | None) -> Any:
    from lpc_mdo.problems.aeroacoustic import PUBLISHED_OBSERVER, Observer

    return Observer(
        PUBLISHED_OBSERVER.distance if distance_ft is None else distance_ft * METRES_PER_FOOT,
        PUBLISHED_OBSERVER.elevation if angle_deg is None else radians(angle_deg),
    )


def _installed(context: click.Context, parameter: click.Parameter, value: str) -> str:
    if value == "ipopt" and importlib.util.find_spec("cyipopt") is None:
        raise click.BadParameter("ipopt is not installed; pip install 'lpc-mdo[ipopt]'.")
    return value


def solver_option(default: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """--solver; studies start from neighbours' optima, where sqp is at home."""
    return click.option(
        "--solver",
        type=click.Choice(["augmented-lagrangian", "sqp", "slsqp", "trust-constr", "ipopt"]),
        default=default,
        show_default=True,
        callback=_installed,
        help="augmented-lagrangian: penalty loop over L-BFGS, Newton's method at its end; sqp: quadratic programs from the "
        "nearest feasible design; others: SciPy's and IPOPT.",
    )


def output_option(name: str, contents: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """--output of every command that writes a folder: None where it is not given, for runs/NAME."""
    return click.option(
        "--output",
        type=click.Path(path_type=Path),
        metavar="FOLDER",
        help=f"Folder to write; default: runs/{name} ({contents}).",
    )


def starts_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of scattered starts; they reach the command as the four of `scattering`."""
    options = [
        click.option("--starts", type=click.IntRange(2, MOST_STARTS), help="Optimize from so many scattered starts."),
        click.option("--seed", type=click.IntRange(min=0), help="Of the scatter; 0 if left out."),
        click.option(
            "--reach", type=float, help="Of the scatter, as a share of every variable's range; 0.1 if left out."
        ),
        click.option("--jobs", type=click.IntRange(min=1), help="Processes for the starts; 1 if left out."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def scattering(starts: int | None, seed: int | None, reach: float | None, jobs: int | None) -> Any:
    """How starts are scattered, None for a single run. Raises ConfigurationError for an option that needs --starts."""
    from lpc_mdo.config import ConfigurationError

    if starts is None:
        for option, value in {"--seed": seed, "--reach": reach, "--jobs": jobs}.items():
            if value is not None:
                raise ConfigurationError(f"{option} is not allowed without --starts; a single run has no use for it.")
        return None
    from lpc_mdo.multi_start import Scattering
    from lpc_mdo.studies.starts import REACH

    return Scattering(starts, seed or 0, REACH if reach is None else reach, jobs or 1)


def _values(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[float, ...]:
    if text and text.count(",") >= MOST_VALUES:
        raise click.BadParameter(f"{text.count(',') + 1} values are too many; there must be at most {MOST_VALUES}.")
    try:
        return tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError:
        raise click.BadParameter(f"{text!r} is not allowed; it must be numbers with commas between them.") from None


def study_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options that both commands share; they reach the command as `common`, a dictionary for `run`."""
    options = [
        click.option("--vehicle", type=click.Path(path_type=Path), help="Vehicle file; the shipped one if left out."),
        click.option("--mission", type=click.Path(path_type=Path), help="Mission file; the shipped one if left out."),
        click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="As in optimize; repeatable."),
        click.option("--values", callback=_values, help="Values of the parameter, e.g. 300,350,400."),
        solver_option("sqp"),
        click.option("--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Processes to use."),
        click.option("--cluster", metavar="ADDRESS", help="Dask scheduler, e.g. tcp://host:8786; extra `cluster`."),
        click.option("--resume", "is_resuming", is_flag=True, help="Go on with the study in the output folder."),
        click.option("--quiet", "is_quiet", is_flag=True, help="No progress display."),
        output_option("NAME", "NAME is the study's"),
    ]
    for option in reversed(options):
        command = option(command)
    return command


@click.command()
@click.argument("front", type=click.Choice(["noise-efficiency", "weight-speed"]))
@click.option("--points", type=click.IntRange(2, MOST_POINTS), help="Points of a front by weighted sums; default: 11.")
@click.option("--method", type=click.Choice(["weighted-sum", "epsilon-constraint"]), help="How the front is traced.")
@click.option("--observer-distance-ft", type=float, help="noise-efficiency; 250 if left out.")
@click.option("--observer-angle-deg", type=float, help="noise-efficiency, from the disk plane; 45 if left out.")
@click.option(
    "--mach",
    callback=_values,
    help="weight-speed by weighted sums: range of the cruise Mach number; default: 0.17,0.19.",
)
@study_options
def pareto(
    front: str,
    output: Path | None,
    points: int | None,
    method: str | None,
    observer_distance_ft: float | None,
    observer_angle_deg: float | None,
    mach: tuple[float, ...],
    vehicle: Path | None,
    mission: Path | None,
    overrides: tuple[str, ...],
    values: tuple[float, ...],
    **how: Any,
) -> int:
    """Trace a FRONT and write a study folder.

    noise-efficiency: level against mean figure of merit in hover, by weighted sums or, evenly spaced, by least figures
    of merit. weight-speed: least gross weight for each cruise speed, --values in m/s; by weighted sums of both, the speed
    being a variable, with the front at fixed speeds beside it.

    Exit code 0: every point converged; 1: some did not, the table says which; 2: bad input.
    """
    from lpc_mdo.config import ConfigurationError, load
    from lpc_mdo.studies import pareto as fronts

    how["output"] = output or RUNS / front
    if front == "weight-speed":
        observer = {"--observer-distance-ft": observer_distance_ft, "--observer-angle-deg": observer_angle_deg}
        _refuse(observer, "is invalid with weight-speed: it is of noise-efficiency.")
        if method != "weighted-sum":
            reason = "is invalid with weight-speed at fixed speeds: it needs --method weighted-sum."
            _refuse({"--points": points, "--mach": mach or None}, reason)
            return _exit_code(_run(fronts.weight_speed(vehicle, mission, overrides, values), **how))
        if values:
            raise ConfigurationError(
                "--values is invalid with --method weighted-sum: --points spaces the weights evenly."
            )
        return _weighted_speed(vehicle, mission, overrides, points or 11, mach, **how)
    _refuse({"--mach": mach or None}, "is invalid with noise-efficiency: it is of weight-speed.")
    if values:
        raise ConfigurationError("--values is not allowed with noise-efficiency; --points spaces them evenly.")
    inputs, observer = load(vehicle, mission, overrides), _observer(observer_distance_ft, observer_angle_deg)
    count = points or 11
    if method != "epsilon-constraint":
        return _exit_code(_run(fronts.noise_efficiency(*inputs, count, observer), **how))
    _require_front(how["output"], how["is_resuming"])
    ends = _run(fronts.noise_efficiency(*inputs, 2, observer), **how | {"output": how["output"] / "ends"})
    if _exit_code(ends) != 0:
        return 1
    efficient, quiet = (point["outputs"]["figure_of_merit_mean"] for point in ends["points"])
    return _exit_code(_run(fronts.noise_efficiency_between(*inputs, (quiet, efficient), count, observer), **how))


def _require_front(folder: Path, is_resuming: bool) -> None:
    """Raises ConfigurationError for a folder that the front between the ends, which are not known yet, could not go to."""
    from lpc_mdo.config import ConfigurationError
    from lpc_mdo.stored.study import FILE, read_study_file
    from lpc_mdo.studies.runner import require_study_folder

    require_study_folder(folder, is_resuming)
    file = folder / FILE
    if file.exists() and read_study_file(file)["method"] != "epsilon-constraint":
        raise ConfigurationError(f"{file}: belongs to a study by another method; name another --output.")


def _refuse(given: dict[str, Any], reason: str) -> None:
    """Raises ConfigurationError for the first option that is given, in which case its value is not None."""
    from lpc_mdo.config import ConfigurationError

    for option, value in given.items():
        if value is not None:
            raise ConfigurationError(f"{option} {reason}")


def _weighted_speed(
    vehicle: Path | None,
    mission: Path | None,
    overrides: tuple[str, ...],
    points: int,
    mach: tuple[float, ...],
    **how: Any,
) -> int:
    """The front by weighted sums, after that at fixed speeds over the same range in a folder of its own."""
    from lpc_mdo.config import ConfigurationError, load
    from lpc_mdo.problems.weight_speed import PUBLISHED_MACH, MachRange
    from lpc_mdo.reporting.stored import BESIDE
    from lpc_mdo.studies import pareto as fronts
    from lpc_mdo.studies.runner import require_own_folder

    if mach and len(mach) != 2:
        raise ConfigurationError("--mach is invalid: it must be two numbers with a comma, e.g. 0.17,0.19.")
    inputs, within = load(vehicle, mission, overrides), MachRange(*mach) if mach else PUBLISHED_MACH
    weighted = fronts.weight_speed_sum(*inputs, points, within)
    low, high = within.speeds(inputs[1])
    speeds = [low + (high - low) * i / 5 for i in range(6)]
    fixed = fronts.weight_speed(vehicle, mission, overrides, speeds)
    require_own_folder(how["output"], how["is_resuming"], weighted, how["solver"])
    codes = [
        _exit_code(_run(fixed, **how | {"output": how["output"] / BESIDE})),
        _exit_code(_run(weighted, **how)),
    ]
    return max(codes)


@click.command()
@click.argument("name")
@study_options
def sweep(
    name: str,
    output: Path | None,
    vehicle: Path | None,
    mission: Path | None,
    overrides: tuple[str, ...],
    values: tuple[float, ...],
    **how: Any,
) -> int:
    """Least gross weight along one parameter, into a study folder.

    NAME: battery-energy-density, final-state-of-charge; a scalar of the files as in --set, e.g. vehicle.wing.taper; or a
    constraint, e.g. sound_pressure_level, whose limit is swept.

    Exit code 0: every point converged; 1: some did not, the table says which; 2: bad input.
    """
    from lpc_mdo.studies.sweep import sweep as study

    how["output"] = output or RUNS / name
    return _exit_code(_run(study(name, vehicle, mission, overrides, values), **how))


def _exit_code(content: dict[str, Any]) -> int:
    return 0 if all(point["status"] == "converged" for point in content["points"]) else 1


def _run(
    study: Any, solver: str, jobs: int, cluster: str | None, is_resuming: bool, is_quiet: bool, output: Path
) -> dict[str, Any]:
    """Run a study with the chosen workers and show it; returns the content of study.json."""
    from lpc_mdo.config import ConfigurationError
    from lpc_mdo.reporting.terminal import terminal
    from lpc_mdo.signals import stoppable
    from lpc_mdo.studies.display import STOPPING, StudyDisplay
    from lpc_mdo.studies.executors import Cluster, Processes
    from lpc_mdo.studies.runner import StudyRun

    if cluster is not None and jobs > 1:
        raise ConfigurationError("--jobs is not allowed with --cluster; the cluster's workers decide.")
    console = terminal(is_quiet)
    with contextlib.ExitStack() as stack:
        if cluster is not None:
            executor = stack.enter_context(contextlib.closing(Cluster(cluster)))
        else:
            executor = Processes(jobs) if jobs > 1 else _here(study, solver)
        display = stack.enter_context(StudyDisplay(console, study))
        stack.enter_context(stoppable(STOPPING))
        content = StudyRun(study, output, executor, solver, report=display.landed).run(is_resuming)
    display.table(content, output)
    return content


def _here(study: Any, solver: str) -> Any:
    """How points run in this process: in one batch where they share their analysis and a solver of ours is asked for."""
    from lpc_mdo.optimization import Options
    from lpc_mdo.studies.executors import InProcess
    from lpc_mdo.studies.lockstep import SERVES, Lockstep

    is_shared = study.problem == "aeroacoustic" and solver in SERVES
    return Lockstep(study, Options(), len(study.values)) if is_shared else InProcess()
