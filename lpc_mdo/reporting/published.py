"""Which results may stand beside the published study: those of its aircraft, mission and problem, and of no other."""

import math
from collections.abc import Mapping
from typing import Any

from lpc_mdo.config import Mission, Vehicle, baseline
from lpc_mdo.problems.aeroacoustic import PUBLISHED_OBSERVER
from lpc_mdo.problems.problem import Problem

SIZES = {
    ("gross-weight", "paper"): (109, 17),
    ("gross-weight", "reduced"): (68, 8),
    ("aeroacoustic", "paper"): (64, 1),
    ("aeroacoustic", "epsilon-constraint"): (64, 2),
}
"""Variables and rows of the published problems as they are posed here; a row of one's own makes another problem."""


def is_published_case(vehicle: Vehicle, mission: Mission, settings: Mapping[str, Any]) -> bool:
    """Shipped aircraft with its bounds, shipped mission, and the study's observer where the settings name one."""
    observer = {
        "observer_distance_m": PUBLISHED_OBSERVER.distance,
        "observer_elevation_deg": math.degrees(PUBLISHED_OBSERVER.elevation),
    }
    is_there = all(math.isclose(settings[key], value) for key, value in observer.items() if key in settings)
    return is_there and (vehicle, mission) == baseline()


def is_published_problem(problem: Problem[Any], vehicle: Vehicle, mission: Mission) -> bool:
    """The same, of one problem, with no variable or row more or less."""
    size = problem.size, len(problem.constraints)
    is_known = SIZES.get((problem.name, problem.formulation)) == size
    return is_known and is_published_case(vehicle, mission, problem.settings)
