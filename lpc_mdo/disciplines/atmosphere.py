"""International Standard Atmosphere to 11 km, with a temperature offset."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import GRAVITY

SEA_LEVEL_TEMPERATURE = 288.15  # K, ISO 2533
SEA_LEVEL_PRESSURE = 101325.0  # Pa, ISO 2533
LAPSE_RATE = 0.0065  # K/m, ISO 2533
GAS_CONSTANT = 287.05287  # J/(kg K), ISO 2533
HEAT_CAPACITY_RATIO = 1.4
LOWEST, HIGHEST = -2000.0, 11000.0  # m, where this layer of ISO 2533 ends


@dataclass(frozen=True)
class Atmosphere:
    """State of the air, each (...,): K, Pa, kg/m^3, m/s, Pa s."""

    temperature: Tensor
    pressure: Tensor
    density: Tensor
    speed_of_sound: Tensor
    dynamic_viscosity: Tensor


def standard_atmosphere(altitude: Tensor, temperature_offset: Tensor | float = 0.0) -> Atmosphere:
    """ISA at geopotential `altitude` (...,) in m. Raises ValueError below -2 and above 11 km.

    The offset (K) changes temperature at unchanged pressure, as on a hot day at a pressure altitude.
    Source: ISO 2533:1975; viscosity by Sutherland's law with its constants.
    """
    is_outside = (altitude < LOWEST) | (altitude > HIGHEST)
    if bool(is_outside.any()):
        worst = float(altitude.detach()[is_outside][0])
        raise ValueError(f"altitude = {worst:g} m is not allowed; it must lie between {LOWEST:g} and {HIGHEST:g}")
    standard = SEA_LEVEL_TEMPERATURE - LAPSE_RATE * altitude
    pressure = SEA_LEVEL_PRESSURE * (standard / SEA_LEVEL_TEMPERATURE) ** (GRAVITY / (LAPSE_RATE * GAS_CONSTANT))
    temperature = standard + temperature_offset
    return Atmosphere(
        temperature=temperature,
        pressure=pressure,
        density=pressure / (GAS_CONSTANT * temperature),
        speed_of_sound=torch.sqrt(HEAT_CAPACITY_RATIO * GAS_CONSTANT * temperature),
        dynamic_viscosity=sutherland_viscosity(temperature),
    )


def sutherland_viscosity(temperature: Tensor) -> Tensor:
    """Dynamic viscosity (...,) Pa s of air at `temperature` (...,) K. Source: ISO 2533:1975."""
    return 1.458e-6 * temperature**1.5 / (temperature + 110.4)
