"""`lpc-mdo sweep`: least gross weight along one parameter."""

from pathlib import Path
from typing import Any

import click

from lpc_mdo.commands.options import RUNS
from lpc_mdo.commands.study_run import exit_code, run_study, study_options


@click.command("sweep")
@click.argument("name")
@study_options
def command(
    name: str,
    output: Path | None,
    vehicle: Path | None,
    mission: Path | None,
    overrides: tuple[str, ...],
    values: tuple[float, ...],
    **how: Any,
) -> int:
    """Trace least gross weight along one parameter. VEHICLE: the aircraft's file; default: the shipped one.

    NAME: battery-energy-density, final-state-of-charge; a scalar of the files as in --set, e.g. vehicle.wing.taper; or a
    constraint, e.g. sound_pressure_level, whose limit is swept.

    Exit code 0: every point converged; 1: some did not, the table says which; 2: bad input.
    """
    from lpc_mdo.studies.sweep import sweep

    how["output"], how["solver"] = output or RUNS / name, how["solver"] or "sqp"
    return exit_code(run_study(sweep(name, vehicle, mission, overrides, values), **how))
