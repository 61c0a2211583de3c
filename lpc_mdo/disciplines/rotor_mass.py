"""Mass of blades and hub of a rotor by the laws of NDARC, which were fitted to helicopters.

Source: Johnson, NDARC, NASA Design and Analysis of Rotorcraft, Theory (NASA/TP-20250010468), section 29-2, models AFDD82 and AFDD00.
A blade of 0.4 m chord and 1.5 m radius lies far outside their population, and they differ by 60 % there: of NASA's own all-electric
Lift+Cruise (rotor group 948 lb, solidity 0.267, 585 ft/s) AFDD82 gives 864 lb for the eight lift rotors with two blades at a flap
frequency of 1.25 a revolution, AFDD00 541 lb. AFDD82 serves wide blades.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import FOOT, POUND

HINGELESS = 1.25  # flap frequency over rotation speed: Johnson and Silva, Aeronautical J. 126 (2022); stopped rotors are of this kind
ARTICULATED = 1.03  # likewise, hinges at 4 % of the radius
TILTING = 1.17940  # factor on the blades of AFDD00 of rotors that tilt
AFDD82_ERROR = (0.077, 0.102)  # mean error of blades, of 37 aircraft, and of hubs, of 35
AFDD00_ERROR = (0.079, 0.122)  # likewise, of 51 aircraft


@dataclass(frozen=True)
class RotorSize:
    """What the laws know of one rotor; each (...,)."""

    radius: Tensor  # m
    chord: Tensor  # m, mean over the blade
    tip_speed: Tensor  # m/s in hover
    blades: Tensor
    flap_frequency: Tensor  # of the rotating blade over the rotation speed


@dataclass(frozen=True)
class RotorMass:
    """kg, each (...,): all blades of a rotor, and its hub with the hinges."""

    blades: Tensor
    hub: Tensor

    @property
    def total(self) -> Tensor:
        return self.blades + self.hub


def rotor_mass_afdd82(size: RotorSize) -> RotorMass:
    """Mass of one rotor (...,). Raises ValueError unless all sizes are positive and the flap frequency is at least 1."""
    radius, chord, tip_speed = _in_feet(size)
    blades, flap = size.blades, size.flap_frequency
    blade = 0.02606 * blades**0.6592 * radius**1.3371 * chord**0.9959 * tip_speed**0.6682 * flap**2.5279
    hub = 0.003722 * blades**0.2807 * radius**1.5377 * tip_speed**0.4290 * flap**2.1414 * blade**0.5505
    return RotorMass(POUND * blade, POUND * hub)


def rotor_mass_afdd00(size: RotorSize, tilt_factor: float = 1.0) -> RotorMass:
    """Mass of one rotor (...,); tilt_factor: `TILTING` if it tilts. Raises ValueError as `rotor_mass_afdd82` does."""
    radius, chord, tip_speed = _in_feet(size)
    blades, flap = size.blades, size.flap_frequency
    blade = 0.0024419 * blades**0.53479 * radius**1.74231 * chord**0.77291 * tip_speed**0.87562 * flap**2.51048
    blade = tilt_factor * blade
    hub = 0.0061182 * blades**0.20373 * radius**0.60406 * tip_speed**0.52803 * flap**1.00218 * blade**0.87127
    return RotorMass(POUND * blade, POUND * hub)


def _in_feet(size: RotorSize) -> tuple[Tensor, Tensor, Tensor]:
    """Radius and chord (...,) ft, tip speed (...,) ft/s."""
    for name, value in vars(size).items():
        least = 1.0 if name == "flap_frequency" else 0.0
        is_wrong = value < least if least else value <= least
        if bool(is_wrong.any()):
            worst = float(value.detach().amin())
            rule = "at least 1: centrifugal force stiffens a blade" if least else "positive"
            raise ValueError(f"{name} = {worst:g} is invalid: it must be {rule}")
    return size.radius / FOOT, size.chord / FOOT, size.tip_speed / FOOT


def mean_chord(chord: Tensor, width: Tensor) -> Tensor:
    """Mean (...,) m of a chord (..., station) m over stations of width (..., station) m."""
    return (chord * width).sum(-1) / torch.broadcast_to(width, chord.shape).sum(-1)
