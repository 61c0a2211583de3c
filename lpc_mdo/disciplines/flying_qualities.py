"""Levels of MIL-F-8785C for the modes of motion: 1 adequate, 2 more workload, 3 controllable, 4 below level 3."""

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from lpc_mdo.disciplines.dynamics import LateralModes, LongitudinalModes

Category = Literal["A", "B", "C"]  # flight phase: A rapid manoeuvring, B climb and cruise, C take-off and landing
AirplaneClass = Literal[1, 2, 3, 4]  # 1 light, 2 medium, land-based, 3 heavy, 4 highly manoeuvrable

INFINITE = float("inf")

PHUGOID_DAMPING = (0.04, 0.0)  # 3.2.1.2, levels 1 and 2
PHUGOID_TIME_TO_DOUBLE = 55.0  # s, level 3
SHORT_PERIOD_DAMPING = {  # table IV, levels 1 to 3
    "A": ((0.35, 1.30), (0.25, 2.00), (0.15, INFINITE)),
    "B": ((0.30, 2.00), (0.20, 2.00), (0.15, INFINITE)),
    "C": ((0.35, 1.30), (0.25, 2.00), (0.15, INFINITE)),
}
CONTROL_ANTICIPATION = {  # figures 1 to 3: squared frequency over load factor per rad, 1/s^2
    "A": ((0.28, 3.6), (0.16, 10.0), (0.16, INFINITE)),
    "B": ((0.085, 3.6), (0.038, 10.0), (0.038, INFINITE)),
    "C": ((0.16, 3.6), (0.096, 10.0), (0.096, INFINITE)),
}
DUTCH_ROLL_LEVEL_1 = {  # table VI: damping ratio, damping ratio x frequency rad/s, frequency rad/s; light and agile, others
    "A": ((0.19, 0.35, 1.0), (0.19, 0.35, 0.4)),
    "B": ((0.08, 0.15, 0.4), (0.08, 0.15, 0.4)),
    "C": ((0.08, 0.15, 1.0), (0.08, 0.10, 0.4)),
}
DUTCH_ROLL_BELOW = ((0.02, 0.05, 0.4), (0.0, -INFINITE, 0.4))  # levels 2 and 3 of all
ROLL_TIME_CONSTANT = {  # table VII, s
    "A": ((1.0, 1.4, 10.0), (1.4, 3.0, 10.0)),
    "B": ((1.4, 3.0, 10.0), (1.4, 3.0, 10.0)),
    "C": ((1.0, 1.4, 10.0), (1.4, 3.0, 10.0)),
}
SPIRAL_TIME_TO_DOUBLE = {"A": (12.0, 8.0, 4.0), "B": (20.0, 8.0, 4.0), "C": (12.0, 8.0, 4.0)}  # table VIII, s


@dataclass(frozen=True)
class LongitudinalLevels:
    """Levels (...,) 1 to 4."""

    short_period_damping: Tensor
    control_anticipation: Tensor
    phugoid: Tensor


@dataclass(frozen=True)
class LateralLevels:
    """Levels (...,) 1 to 4."""

    dutch_roll: Tensor
    roll: Tensor
    spiral: Tensor


def longitudinal_levels(
    modes: LongitudinalModes, acceleration_sensitivity: Tensor, category: Category = "B"
) -> LongitudinalLevels:
    """Levels of MIL-F-8785C, 3.2.1.2 and 3.2.2.1; acceleration_sensitivity (...,) 1/rad.

    The least short-period frequencies that figures 1 and 3 add for categories A and C are not checked.
    """
    damping, anticipation = SHORT_PERIOD_DAMPING[category], CONTROL_ANTICIPATION[category]
    ratio = modes.short_period.damping_ratio
    share = modes.short_period.natural_frequency**2 / acceleration_sensitivity
    phugoid = modes.phugoid
    met = [phugoid.damping_ratio >= least for least in PHUGOID_DAMPING]
    return LongitudinalLevels(
        short_period_damping=_first([(ratio >= low) & (ratio <= high) for low, high in damping]),
        control_anticipation=_first([(share >= low) & (share <= high) for low, high in anticipation]),
        phugoid=_first([*met, phugoid.time_to_double >= PHUGOID_TIME_TO_DOUBLE]),
    )


def lateral_levels(modes: LateralModes, airplane_class: AirplaneClass = 1, category: Category = "B") -> LateralLevels:
    """Levels of MIL-F-8785C, 3.3.1.1 to 3.3.1.3; a roll joined with the spiral to an oscillation meets none."""
    group = 0 if airplane_class in (1, 4) else 1
    ratio, frequency = modes.dutch_roll.damping_ratio, modes.dutch_roll.natural_frequency
    limits = (DUTCH_ROLL_LEVEL_1[category][group], *DUTCH_ROLL_BELOW)
    dutch_roll = [(ratio >= a) & (ratio * frequency >= b) & (frequency >= c) for a, b, c in limits]
    constant = modes.roll.time_constant
    is_subsidence = (modes.roll.eigenvalue.imag == 0.0) & (constant > 0.0)
    return LateralLevels(
        dutch_roll=_first(dutch_roll),
        roll=_first([is_subsidence & (constant <= most) for most in ROLL_TIME_CONSTANT[category][group]]),
        spiral=_first([modes.spiral.time_to_double >= least for least in SPIRAL_TIME_TO_DOUBLE[category]]),
    )


def _first(met: list[Tensor]) -> Tensor:
    """1 + index of the first requirement met, len + 1 if none."""
    level = torch.full(met[0].shape, len(met) + 1, device=met[0].device)
    for index in reversed(range(len(met))):
        level = torch.where(met[index], index + 1, level)
    return level


def dutch_roll_margins(modes: LateralModes, airplane_class: AirplaneClass = 1, category: Category = "B") -> Tensor:
    """By how much damping ratio, damping ratio x frequency rad/s and frequency rad/s (..., 3) exceed the least of level 1."""
    least = DUTCH_ROLL_LEVEL_1[category][0 if airplane_class in (1, 4) else 1]
    ratio, frequency = modes.dutch_roll.damping_ratio, modes.dutch_roll.natural_frequency
    found = torch.stack([ratio, ratio * frequency, frequency], dim=-1)
    return found - torch.tensor(least, dtype=found.dtype, device=found.device)


def short_period_margins(
    modes: LongitudinalModes, acceleration_sensitivity: Tensor, category: Category = "B"
) -> Tensor:
    """Margins (..., 4) to level 1, negative outside: of the damping ratio, low and high, and of the control anticipation, in logarithms.

    acceleration_sensitivity (...,) 1/rad. The logarithm tells a factor: 0.1 is ten per cent inside.
    """
    ratio = modes.short_period.damping_ratio
    share = modes.short_period.natural_frequency**2 / acceleration_sensitivity
    (low, high), (slow, fast) = SHORT_PERIOD_DAMPING[category][0], CONTROL_ANTICIPATION[category][0]
    return torch.stack([ratio - low, high - ratio, torch.log(share / slow), torch.log(fast / share)], dim=-1)
