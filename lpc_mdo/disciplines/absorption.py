"""What the air takes from sound on its way: spherical spreading and atmospheric absorption (ISO 9613-1)."""

import torch
from torch import Tensor

from lpc_mdo.disciplines.atmosphere import SEA_LEVEL_PRESSURE

REFERENCE_TEMPERATURE = 293.15  # K, ISO 9613-1
TRIPLE_POINT_TEMPERATURE = 273.16  # K, ISO 9613-1
DECIBELS_PER_NEPER = 8.686  # as rounded in ISO 9613-1


def water_vapour_concentration(temperature: Tensor, pressure: Tensor, relative_humidity: Tensor) -> Tensor:
    """Molar concentration (...,) of water vapour as a share of the air's molecules.

    temperature K, pressure Pa, relative_humidity between 0 and 1, all broadcast. Source: ISO 9613-1:1993, annex B.
    """
    exponent = -6.8346 * (TRIPLE_POINT_TEMPERATURE / temperature) ** 1.261 + 4.6151
    return relative_humidity * 10.0**exponent * SEA_LEVEL_PRESSURE / pressure


def atmospheric_absorption(
    frequency: Tensor, temperature: Tensor, pressure: Tensor, relative_humidity: Tensor
) -> Tensor:
    """Absorption (...,) dB/m of a pure tone in still air of uniform state.

    frequency Hz, temperature K, pressure Pa, relative_humidity between 0 and 1, all broadcast. The standard states 10 %
    for 253 K to 323 K, vapour concentrations of 0.05 % to 5 %, pressures below 200 kPa and frequency over pressure from
    4e-4 to 10 Hz/Pa. Source: ISO 9613-1:1993, equations 3 to 5.
    """
    share = pressure / SEA_LEVEL_PRESSURE
    ratio = temperature / REFERENCE_TEMPERATURE
    vapour = 100.0 * water_vapour_concentration(temperature, pressure, relative_humidity)  # %
    oxygen = share * (24.0 + 4.04e4 * vapour * (0.02 + vapour) / (0.391 + vapour))
    nitrogen = share * ratio**-0.5 * (9.0 + 280.0 * vapour * torch.exp(-4.170 * (ratio ** (-1.0 / 3.0) - 1.0)))
    squared = frequency**2
    classical = 1.84e-11 * torch.sqrt(ratio) / share
    relaxation = 0.01275 * torch.exp(-2239.1 / temperature) / (oxygen + squared / oxygen)
    relaxation = relaxation + 0.1068 * torch.exp(-3352.0 / temperature) / (nitrogen + squared / nitrogen)
    return DECIBELS_PER_NEPER * squared * (classical + ratio**-2.5 * relaxation)


def spherical_spreading(distance: Tensor, reference_distance: Tensor | float = 1.0) -> Tensor:
    """Level (...,) dB lost between `reference_distance` and `distance` (...,) m from a compact source."""
    return 20.0 * torch.log10(distance / reference_distance)


def transmitted_share(absorption: Tensor, path: Tensor) -> Tensor:
    """What absorption (...,) dB/m leaves of a squared pressure after `path` (...,) m; all broadcast."""
    return 10.0 ** (-0.1 * absorption * path)
