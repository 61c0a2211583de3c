"""The gross-weight problem with the cruise speed as a variable: a weighted sum of gross mass and speed, as published.

Source: Ruh et al. (2023) for the weighted sum; Mach 0.17 to 0.19 from their public script ex_tc1_trim_run.py.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.schedule import flight_speed_name
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Objective, Problem, Variable
from lpc_mdo.problems.rows import stall_margin_row

MASS_SCALE = 100.0  # kg that count in the sum as much as the whole range of speed: they make the two parts comparable


@dataclass(frozen=True)
class MachRange:
    """Bounds of the cruise Mach number at the mission's cruise altitude. Raises ConfigurationError unless a range."""

    lower: float = 0.17
    upper: float = 0.19

    def __post_init__(self) -> None:
        if not 0.05 <= self.lower < self.upper <= 0.5:
            raise ConfigurationError(
                f"Mach numbers {self.lower:g} to {self.upper:g} are invalid: they must increase and lie between 0.05 and 0.5."
            )

    def speeds(self, mission: Mission) -> tuple[float, float]:
        """m/s in the mission's air."""
        altitude = torch.tensor(mission.main_segment.level_altitude, dtype=torch.float64)
        sound = float(standard_atmosphere(altitude, mission.temperature_offset).speed_of_sound)
        return self.lower * sound, self.upper * sound


PUBLISHED_MACH = MachRange()


def weight_speed_front(
    vehicle: Vehicle, mission: Mission, speed_weights: Sequence[float], mach: MachRange = PUBLISHED_MACH
) -> list[Problem[Analysis]]:
    """One problem a weight w: minimize (1 - w) mass/100 kg - w speed/range; 110 variables, all with the same analysis.

    At w = 1 mass is not minimized at all: any feasible aircraft at the largest speed is an optimum. Raises ConfigurationError
    for a weight beyond 0 and 1, or a mission whose speed, the start, lies outside `mach`.
    """
    low, high = mach.speeds(mission)
    cruise = mission.main_segment
    start = mission.speed(cruise.name)
    if not low <= start <= high:
        raise ConfigurationError(
            f"mission: {cruise.name}.speed_m_per_s = {start:g} is invalid: with the speed as a variable it must lie between "
            f"{low:.4g} and {high:.4g}, Mach {mach.lower:g} and {mach.upper:g} at the cruise altitude."
        )
    published = gross_weight_problem(vehicle, mission)
    reason = f"Mach {mach.lower:g} to {mach.upper:g} at the mission's cruise altitude"
    margin, name = stall_margin_row(published.analyze_design.schedule), flight_speed_name(cruise.name)
    shared = replace(
        published,
        name="weight-speed",
        variables=(*published.variables, Variable(name, "m/s", low, high, start, reason=reason)),
        constraints=tuple(margin if row.name in ("stall_speed", margin.name) else row for row in published.constraints),
    )
    return [
        replace(shared, objective=_weighted(weight, high - low), settings={"speed_weight": weight})
        for weight in speed_weights
    ]


def _weighted(weight: float, span: float) -> Objective[Analysis]:
    if not 0.0 <= weight <= 1.0:
        raise ConfigurationError(f"speed weight = {weight:g} is invalid: it must lie between 0 and 1.")

    def objective(a: Analysis) -> Tensor:
        return (1.0 - weight) * a.gross_mass / MASS_SCALE - weight * a.main_segment.speed / span

    return Objective("mass_and_speed", "1", objective)
