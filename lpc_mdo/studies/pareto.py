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
from lpc_mdo.problems.weight_speed import MASS_SCALE, PUBLISHED_MACH, MachRange, weight_speed_front
from lpc_mdo.studies.study import Axis, Parameter, Study
from lpc_mdo.studies.sweep import Envelope, by_key, ordered

MERIT = Axis("figure_of_merit_mean", "1", "maximize")
LEVEL = Axis("sound_pressure_level_dba", "dB(A)", "minimize")
SPEED = Axis("cruise_speed_m_per_s", "m/s", "maximize")
MASS = Axis("gross_mass_kg", "kg", "minimize")
AT_BOUND = 1e-6  # of half the range of speed


def non_dominated(positions: Sequence[Sequence[float]], goals: Sequence[str], resolution: float = 0.0) -> list[bool]:
    """Whether no other point is at least as good in every direction and better in one; goals "minimize" or "maximize".

    Values that differ by less than `resolution`, relative, count as equal.
    """
    signs = [-1.0 if goal == "maximize" else 1.0 for goal in goals]
    costs = [tuple(sign * value for sign, value in zip(signs, position, strict=True)) for position in positions]

    def dominates(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
        gaps = [(b - a, resolution * max(abs(a), abs(b))) for a, b in zip(one, other, strict=True)]
        return all(gap >= -equal for gap, equal in gaps) and any(gap > equal for gap, equal in gaps)

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


def _weights(points: int) -> tuple[float, ...]:
    if points < 2:
        raise ConfigurationError(f"--points {points} is not allowed; a front needs at least 2.")
    return tuple(i / (points - 1) for i in range(points))


def noise_efficiency(
    vehicle: Vehicle, mission: Mission, points: int = 11, observer: Observer = PUBLISHED_OBSERVER
) -> Study:
    """Noise weights from 0 to 1. Raises ConfigurationError for fewer than 2 points."""
    return Study(
        kind="pareto",
        name="noise-efficiency",
        problem="aeroacoustic",
        formulation="paper",
        inputs=(vehicle, mission),
        method="weighted-sum",
        parameter=Parameter("noise_weight", "1"),
        axes=(MERIT, LEVEL),
        values=_weights(points),
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
    """Least gross weight for each speed m/s of the mission's main segment, its cruise, by default from the file's speed to 11 % above it, in 5 steps."""
    flown = load(vehicle, mission, overrides)[1]
    name = flown.main_segment.name
    key = f"mission.{name}.speed_m_per_s"
    if not speeds:
        speed = flown.speed(name)
        speeds = [speed * (1.0 + 0.11 * i / 5) for i in range(6)]
    values = ordered(speeds)
    problems = by_key(vehicle, mission, overrides, key, values)
    return Study(
        kind="pareto",
        name="weight-speed",
        problem="gross-weight",
        formulation="paper",
        inputs=load(vehicle, mission, overrides),
        method="epsilon-constraint",
        parameter=Parameter("cruise_speed", "m/s", key),
        axes=(Axis("cruise_speed", "m/s", "maximize"), MASS),
        values=values,
        problems=problems,
        slope=Envelope(problems),
    )


@dataclass(frozen=True)
class _WeightSpeed:
    """The problems along the front of weighted sums; values are weights of the speed."""

    vehicle: Vehicle
    mission: Mission
    mach: MachRange

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        return weight_speed_front(self.vehicle, self.mission, values, self.mach)


def speed_slope(value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> float | None:
    """Slope of the front where (1 - w) mass/100 kg - w speed/range has a minimum between the bounds of speed.

    None where the speed stands on a bound: there the weight only says on which side of it the slope lies.
    """
    if value == 1.0 or abs(float(x[-1])) >= 1.0 - AT_BOUND:
        return None
    speed = problem.variables[-1]
    return value / (1.0 - value) * MASS_SCALE / float(speed.upper_tensor - speed.lower_tensor)


def weight_speed_sum(vehicle: Vehicle, mission: Mission, points: int = 11, mach: MachRange = PUBLISHED_MACH) -> Study:
    """The published form: weights of the speed from 0 to 1, the speed being a variable.

    Raises ConfigurationError for fewer than 2 points, or a mission whose speed lies outside `mach`.
    """
    problems = _WeightSpeed(vehicle, mission, mach)
    values = _weights(points)
    problems(values[:1])  # a mission out of range is told before anything runs
    return Study(
        kind="pareto",
        name="weight-speed",
        problem="weight-speed",
        formulation="paper",
        inputs=(vehicle, mission),
        method="weighted-sum",
        parameter=Parameter("speed_weight", "1"),
        axes=(SPEED, MASS),
        values=values,
        problems=problems,
        slope=speed_slope,
        # Every feasible aircraft is an optimum there: from a neighbour's it would stay at that one's mass.
        from_baseline=(points - 1,),
    )
