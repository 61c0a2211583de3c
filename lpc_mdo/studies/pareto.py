"""Fronts: noise against efficiency of the rotors, gross weight against cruise speed; and what belongs on a front."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle, load
from lpc_mdo.problems.aeroacoustic import (
    MERIT_SCALE,
    NOISE_SCALE,
    PUBLISHED_OBSERVER,
    LeastMerit,
    Observer,
    WeightedSum,
    aeroacoustic_front,
)
from lpc_mdo.problems.problem import Problem
from lpc_mdo.studies.study import Axis, Parameter, Study
from lpc_mdo.studies.sweep import Envelope, by_key, ordered

MERIT = Axis("figure_of_merit_mean", "1", "maximize")
LEVEL = Axis("sound_pressure_level_dba", "dB(A)", "minimize")


def non_dominated(positions: Sequence[Sequence[float]], goals: Sequence[str]) -> list[bool]:
    """Whether no other point is at least as good in every direction and better in one; goals "minimize" or "maximize"."""
    signs = [-1.0 if goal == "maximize" else 1.0 for goal in goals]
    costs = [tuple(sign * value for sign, value in zip(signs, position, strict=True)) for position in positions]

    def dominates(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
        return one != other and all(a <= b for a, b in zip(one, other, strict=True))

    return [not any(dominates(other, cost) for other in costs) for cost in costs]


@dataclass(frozen=True)
class _NoiseEfficiency:
    """The problems along the front; values are noise weights or least figures of merit."""

    vehicle: Vehicle
    mission: Mission
    trade: type[WeightedSum] | type[LeastMerit]
    observer: Observer

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        trades = [self.trade(value) for value in values]
        return aeroacoustic_front(self.vehicle, self.mission, trades, self.observer)


def weighted_slope(value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> float | None:
    """Slope of the front where w level/10 - (1 - w) merit/0.1 has a minimum: its line touches the front there."""
    return None if value == 0.0 else (1.0 - value) / value * NOISE_SCALE / MERIT_SCALE


def noise_efficiency(
    vehicle: Vehicle, mission: Mission, points: int = 11, observer: Observer = PUBLISHED_OBSERVER
) -> Study:
    """Noise weights from 0 to 1. Raises ConfigurationError for fewer than 2 points."""
    if points < 2:
        raise ConfigurationError(f"--points {points} is not allowed; a front needs at least 2.")
    return Study(
        kind="pareto",
        name="noise-efficiency",
        problem="aeroacoustic",
        formulation="paper",
        inputs=(vehicle, mission),
        method="weighted-sum",
        parameter=Parameter("noise_weight", "1"),
        axes=(MERIT, LEVEL),
        values=tuple(i / (points - 1) for i in range(points)),
        problems=_NoiseEfficiency(vehicle, mission, WeightedSum, observer),
        slope=weighted_slope,
    )


def noise_efficiency_between(
    vehicle: Vehicle,
    mission: Mission,
    ends: tuple[float, float],
    points: int = 11,
    observer: Observer = PUBLISHED_OBSERVER,
) -> Study:
    """Least figures of merit evenly between those of the quietest and the most efficient blades, ends left out."""
    quiet, efficient = ends
    if not quiet < efficient:
        raise ConfigurationError(f"the ends' figures of merit, {quiet:.4g} and {efficient:.4g}, span no front.")
    problems = _NoiseEfficiency(vehicle, mission, LeastMerit, observer)
    return Study(
        kind="pareto",
        name="noise-efficiency",
        problem="aeroacoustic",
        formulation="epsilon-constraint",
        inputs=(vehicle, mission),
        method="epsilon-constraint",
        parameter=Parameter("least_mean_figure_of_merit", "1", "mean_figure_of_merit"),
        axes=(MERIT, LEVEL),
        values=tuple(quiet + (efficient - quiet) * (i + 1) / (points + 1) for i in range(points)),
        problems=problems,
        slope=Envelope(problems),
    )


def weight_speed(
    vehicle: Path | None, mission: Path | None, overrides: Sequence[str] = (), speeds: Sequence[float] = ()
) -> Study:
    """Least gross weight for each cruise speed m/s, by default from the file's speed to 11 % above it, in 5 steps."""
    if not speeds:
        speed = load(vehicle, mission, overrides)[1].cruise.speed
        speeds = [speed * (1.0 + 0.11 * i / 5) for i in range(6)]
    values = ordered(speeds)
    problems = by_key(vehicle, mission, overrides, "mission.cruise.speed_m_per_s", values)
    return Study(
        kind="pareto",
        name="weight-speed",
        problem="gross-weight",
        formulation="paper",
        inputs=load(vehicle, mission, overrides),
        method="epsilon-constraint",
        parameter=Parameter("cruise_speed", "m/s", "mission.cruise.speed_m_per_s"),
        axes=(Axis("cruise_speed", "m/s", "maximize"), Axis("gross_mass_kg", "kg", "minimize")),
        values=values,
        problems=problems,
        slope=Envelope(problems),
    )
