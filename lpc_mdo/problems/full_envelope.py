"""The same objective for an aircraft that can be built and flown: the shipped mission of the whole flight envelope and its rows.

Nothing but the mission makes it another problem than the published one: docs/full-envelope.md.
"""

from dataclasses import replace
from importlib import resources
from pathlib import Path

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.problems.gross_weight import aircraft_problem
from lpc_mdo.problems.problem import Problem

NAME = "full-envelope"


def full_envelope_mission() -> Path:
    """The shipped mission file."""
    return Path(str(resources.files("lpc_mdo.data").joinpath("full_envelope.toml")))


def full_envelope_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """Least gross mass on a mission whose rows hold every motor to its torque: the vehicle file's bounds of motors stand as they are."""
    return replace(aircraft_problem(vehicle, mission), name=NAME)
