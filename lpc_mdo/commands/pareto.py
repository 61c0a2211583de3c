"""`lpc-mdo pareto`: fronts of two objectives."""

from pathlib import Path
from typing import Any

import click

from lpc_mdo.commands.options import RUNS, observer
from lpc_mdo.commands.study_run import exit_code, numbers, run_study, study_options

MOST_POINTS = 400  # of a front


@click.command("pareto")
@click.argument("front", type=click.Choice(["noise-efficiency", "weight-speed"]))
@click.option("--points", type=click.IntRange(2, MOST_POINTS), help="Points of a front by weighted sums; default: 11.")
@click.option("--method", type=click.Choice(["weighted-sum", "epsilon-constraint"]), help="How the front is traced.")
@click.option("--observer-distance-ft", type=float, help="noise-efficiency; default: 250.")
@click.option("--observer-angle-deg", type=float, help="noise-efficiency, from the disk plane; default: 45.")
@click.option(
    "--mach",
    callback=numbers,
    help="weight-speed by weighted sums: range of the cruise Mach number; default: 0.17,0.19.",
)
@study_options
def command(
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
    """Trace a FRONT and write a study folder. VEHICLE: the aircraft's file; default: the shipped one.

    noise-efficiency: level against mean figure of merit in hover, by weighted sums or, evenly spaced, by least figures
    of merit. weight-speed: least gross weight for each cruise speed, --values in m/s; by weighted sums of both, the speed
    being a variable, with the front at fixed speeds beside it.

    Exit code 0: every point converged; 1: some did not, the table says which; 2: bad input.
    """
    from lpc_mdo.config import load
    from lpc_mdo.files.read import ConfigurationError
    from lpc_mdo.studies import pareto as fronts

    how["output"] = output or RUNS / front
    # From neighbours' optima sqp is at home; from the baseline, side by side, the many small steps of L-BFGS cost least.
    how["solver"] = how["solver"] or ("sqp" if front == "weight-speed" else "augmented-lagrangian")
    if front == "weight-speed":
        where = {"--observer-distance-ft": observer_distance_ft, "--observer-angle-deg": observer_angle_deg}
        _refuse(where, "is invalid with weight-speed: it is of noise-efficiency.")
        if method != "weighted-sum":
            reason = "is invalid with weight-speed at fixed speeds: it needs --method weighted-sum."
            _refuse({"--points": points, "--mach": mach or None}, reason)
            return exit_code(run_study(fronts.weight_speed(vehicle, mission, overrides, values), **how))
        if values:
            raise ConfigurationError(
                "--values is invalid with --method weighted-sum: --points spaces the weights evenly."
            )
        return _weighted_speed(vehicle, mission, overrides, points or 11, mach, **how)
    _refuse({"--mach": mach or None}, "is invalid with noise-efficiency: it is of weight-speed.")
    if values:
        raise ConfigurationError("--values is not allowed with noise-efficiency; --points spaces them evenly.")
    inputs, listener = load(vehicle, mission, overrides), observer(observer_distance_ft, observer_angle_deg)
    count = points or 11
    if method != "epsilon-constraint":
        return exit_code(run_study(fronts.noise_efficiency(*inputs, count, listener), **how))
    _require_front(how["output"], how["is_resuming"])
    ends = run_study(fronts.noise_efficiency(*inputs, 2, listener), **how | {"output": how["output"] / "ends"})
    if exit_code(ends) != 0:
        return 1
    efficient, quiet = (point["outputs"]["figure_of_merit_mean"] for point in ends["points"])
    return exit_code(run_study(fronts.noise_efficiency_between(*inputs, (quiet, efficient), count, listener), **how))


def _require_front(folder: Path, is_resuming: bool) -> None:
    """Raises ConfigurationError for a folder that the front between the ends, which are not known yet, could not go to."""
    from lpc_mdo.files.read import ConfigurationError
    from lpc_mdo.stored.study import FILE, read_study_file
    from lpc_mdo.studies.runner import require_study_folder

    require_study_folder(folder, is_resuming)
    file = folder / FILE
    if file.exists() and read_study_file(file)["method"] != "epsilon-constraint":
        raise ConfigurationError(f"{file}: belongs to a study by another method; name another --output.")


def _refuse(given: dict[str, Any], reason: str) -> None:
    """Raises ConfigurationError for the first option that is given, in which case its value is not None."""
    from lpc_mdo.files.read import ConfigurationError

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
    from lpc_mdo.config import load
    from lpc_mdo.files.read import ConfigurationError
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
        exit_code(run_study(fixed, **how | {"output": how["output"] / BESIDE})),
        exit_code(run_study(weighted, **how)),
    ]
    return max(codes)
