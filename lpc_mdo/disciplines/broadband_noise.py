"""Broadband noise of rotors by Schlegel, King and Mull (USAAML TR 65-4) and by Gill and Lee (spectral fit, 2023)."""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.sound import squared_pressure, third_octave_centers

LEVEL_CONSTANT = -42.9  # dB with SI units, as used by the published study's code; TR 65-4 converted gives -40.6
REFERENCE_DISTANCE = 45.72  # m: 150 ft, to which the constant belongs (at 150 m it would be -50.9)
CODE_REFERENCE_DISTANCE = 150.0  # m: the codes of the study's authors divide metres by 150, which is 10.3 dB louder
STROUHAL_NUMBER = 0.28  # peak frequency x projected thickness / velocity at 0.7 R
OCTAVES = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # band centres over the peak frequency, and
OCTAVE_LEVELS = (-7.92, -4.17, -8.33, -8.75, -12.92, -13.33)  # dB relative to the overall level
FITTED_DISTANCE = 14.3  # radii: where Gill and Lee's formula is compared with a measurement, and evaluated here
LEAST_THRUST_COEFFICIENT = 1e-4  # below it the fit, made for 0.005 to 0.02, means nothing


@dataclass(frozen=True)
class BroadbandNoise:
    """overall (...,) Pa^2; bands `thirds` third-octaves wide, centred at `frequency` (..., band) Hz, `bands` (..., band) Pa^2.

    `frequency` may lack the leading dimensions where all rotors have the same bands.
    """

    overall: Tensor
    frequency: Tensor
    bands: Tensor
    thirds: int


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
    return BroadbandNoise(overall, peak[..., None] * octaves, overall[..., None] * shares, thirds=3)


def gill_lee(
    thrust: Tensor,
    radius: Tensor,
    tip_speed: Tensor,
    blade_area: Tensor,
    blades: Tensor,
    density: Tensor,
    speed_of_sound: Tensor,
    elevation_sine: Tensor,
    distance: Tensor,
) -> BroadbandNoise:
    """Broadband noise (...,) of rotors in hover in third-octave bands from 20 Hz to 20 kHz, all inputs (...,).

    thrust N, radius m, tip_speed m/s, blade_area m^2 (all blades), density kg/m^3, speed_of_sound m/s; elevation_sine: sine
    of the observer's angle from the disk plane; distance m. A formula fitted to computations of trailing-edge, bluntness
    and stall noise of rotors in hover, in the form and with the constants of the open code lsdo_acoustics (LSDO lab, UC
    San Diego). Its own dependence on distance contradicts spherical spreading, so it is evaluated at 14.3 radii and spread from
    there. Thrust coefficients below 1e-4 count as 1e-4.
    """
    solidity = blade_area / (math.pi * radius**2)
    thrust_coefficient = (thrust / (density * math.pi * radius**2 * tip_speed**2)).clamp(min=LEAST_THRUST_COEFFICIENT)
    mach, sine = tip_speed / speed_of_sound, elevation_sine.abs()
    shift = solidity * torch.log10(thrust_coefficient) + 0.9 * mach * solidity * (mach + 3.82) * torch.log10(solidity)
    fall = 1.0 - thrust_coefficient * mach * (thrust_coefficient - sine + 2.06)
    steep = 4.97 * thrust_coefficient * sine * (1.5 * FITTED_DISTANCE * mach - FITTED_DISTANCE + 15.0)

    centers = third_octave_centers().to(thrust)
    chord = blade_area / (blades * radius)
    x = centers * (chord / tip_speed)[..., None] - shift[..., None]  # Strouhal number, shifted
    rise = 78.4 * torch.log10(tip_speed)[..., None] * x**0.6
    level = rise / (
        (x + 2.06 - 2.0 * mach[..., None] ** 2) ** fall[..., None]
        + (thrust_coefficient[..., None] * x) ** steep[..., None]
    )
    spread = (FITTED_DISTANCE * radius / distance) ** 2
    bands = squared_pressure(level) * spread[..., None]
    return BroadbandNoise(bands.sum(-1), centers, bands, thirds=1)
