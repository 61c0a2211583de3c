"""Broadband noise of rotors by Schlegel, King and Mull (USAAML TR 65-4)."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.sound import squared_pressure

LEVEL_CONSTANT = -42.9  # dB with SI units, as used by the published study's code; TR 65-4 converted gives -40.6
REFERENCE_DISTANCE = 45.72  # m: 150 ft, to which the constant belongs (at 150 m it would be -50.9)
PAPER_REFERENCE_DISTANCE = 150.0  # m: the published code divides metres by 150, which is 10.3 dB louder
STROUHAL_NUMBER = 0.28  # peak frequency x projected thickness / velocity at 0.7 R
OCTAVES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # band centres over the peak frequency, and
OCTAVE_LEVELS = (-7.92, -4.17, -8.33, -8.75, -12.92, -13.33)  # dB relative to the overall level


@dataclass(frozen=True)
class BroadbandNoise:
    """overall (...,) Pa^2; octave bands centred at `frequency` (..., 6) Hz with `bands` (..., 6) Pa^2."""

    overall: Tensor
    frequency: Tensor
    bands: Tensor


def schlegel_king_mull(
    thrust: Tensor,
    radius: Tensor,
    tip_speed: Tensor,
    blade_area: Tensor,
    density: Tensor,
    elevation_sine: Tensor,
    distance: Tensor,
    projected_thickness: Tensor,
    reference_distance: float = REFERENCE_DISTANCE,
) -> BroadbandNoise:
    """Broadband noise (...,) of rotors in hover.

    thrust N, radius m, tip_speed m/s, blade_area m^2 (all blades), density kg/m^3; elevation_sine: sine of the observer's
    angle from the disk plane; distance m; projected_thickness m: blade thickness across the flow at 0.7 R. A dipole along
    the axis, loudest below; from helicopter rotors more than three radii away.
    """
    disk_area = math.pi * radius**2
    solidity = blade_area / disk_area
    thrust_coefficient = thrust / (density * disk_area * tip_speed**2)
    blade_loading = (thrust_coefficient / solidity) ** 2 + 1e-6
    strength = tip_speed**6 * blade_area * blade_loading
    directivity = (elevation_sine**2 + 1e-4) * (reference_distance / distance) ** 2
    overall = squared_pressure(10.0 * torch.log10(strength * directivity) + LEVEL_CONSTANT)
    octaves = torch.tensor(OCTAVES, dtype=overall.dtype, device=overall.device)
    shares = 10.0 ** (torch.tensor(OCTAVE_LEVELS, dtype=overall.dtype, device=overall.device) / 10.0)
    peak = STROUHAL_NUMBER * 0.7 * tip_speed / projected_thickness
    return BroadbandNoise(overall, peak[..., None] * octaves, overall[..., None] * shares)
