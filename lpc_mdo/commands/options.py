"""Options that several commands share."""

import functools
import importlib.util
from collections.abc import Callable, Sequence
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from lpc_mdo.problems.aeroacoustic import Observer

METRES_PER_FOOT = 0.3048
MOST_JOBS = 256  # processes of this machine
RUNS = Path("runs")  # where results go unless --output names another folder

Decorated = Callable[..., Any]


def applied(options: Sequence[Callable[..., Any]], command: Decorated) -> Decorated:
    """The command with all options, which its help shows in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def input_options(command: Decorated) -> Decorated:
    """VEHICLE as the last argument or as --vehicle, --mission and --set; they reach the command as vehicle, mission and
    overrides."""

    @functools.wraps(command)
    def with_vehicle(*args: Any, vehicle: Path | None, vehicle_option: Path | None, **others: Any) -> Any:
        if vehicle is not None and vehicle_option is not None:
            raise click.UsageError("--vehicle is invalid beside the argument VEHICLE; it must be given once.")
        return command(*args, vehicle=vehicle if vehicle_option is None else vehicle_option, **others)

    options = [
        click.argument("vehicle", required=False, type=click.Path(path_type=Path)),
        click.option("--vehicle", "vehicle_option", type=click.Path(path_type=Path), help="The same as VEHICLE."),
        click.option("--mission", type=click.Path(path_type=Path), help="Mission file; default: the shipped one."),
        click.option(
            "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="E.g. vehicle.wing.area_m2=18; repeatable."
        ),
    ]
    return applied(options, with_vehicle)


class _Solver(click.ParamType[str]):
    """A name of the registry, which is loaded where one is given: help must not wait for torch."""

    name = "name"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        from lpc_mdo.optimization.registry import OPTIMIZERS

        return str(click.Choice(list(OPTIMIZERS)).convert(value, param, ctx))


def _installed(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    if value == "ipopt" and importlib.util.find_spec("cyipopt") is None:
        raise click.BadParameter("ipopt is not installed; pip install 'lpc-mdo[ipopt]'.")
    return value


def solver_option(default: str | None) -> Callable[[Decorated], Decorated]:
    """--solver; None: the command decides."""
    return click.option(
        "--solver",
        type=_Solver(),
        default=default,
        show_default=True,
        callback=_installed,
        help="augmented-lagrangian: penalty loop over L-BFGS, Newton's method at its end; sqp: quadratic programs from the "
        "nearest feasible design; slsqp and trust-constr: SciPy's; ipopt: IPOPT. Default: sqp from neighbours' optima and "
        "scattered starts, else augmented-lagrangian.",
    )


class _Folder(click.Path):
    """A folder's name: an empty one, as of a shell variable that is not set, is not the folder that one is in."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not str(value).strip():
            self.fail(f"{value!r} is invalid: it must name a folder.", param, ctx)
        return super().convert(value, param, ctx)


def output_option(name: str, contents: str) -> Callable[[Decorated], Decorated]:
    """--output of every command that writes a folder: None where it is not given, for runs/NAME."""
    return click.option(
        "--output",
        type=_Folder(path_type=Path),
        metavar="FOLDER",
        help=f"Folder to write; default: runs/{name} ({contents}).",
    )


def observer(distance_ft: float | None, angle_deg: float | None) -> "Observer":
    """Who hears the hover case; each of its coordinates is the published one where it is None."""
    from lpc_mdo.problems.aeroacoustic import PUBLISHED_OBSERVER, Observer

    return Observer(
        PUBLISHED_OBSERVER.distance if distance_ft is None else distance_ft * METRES_PER_FOOT,
        PUBLISHED_OBSERVER.elevation if angle_deg is None else radians(angle_deg),
    )
