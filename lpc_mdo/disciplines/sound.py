"""Levels, A-weighting and the addition of sound energies."""

import math

import torch
from torch import Tensor

REFERENCE_PRESSURE = 20e-6  # Pa, ISO 1683
PRESSURE_FLOOR = 1e-7  # Pa (-46 dB): keeps the logarithm's slope finite where a tone vanishes
WEIGHTING_POLES = (20.598997, 107.65265, 737.86223, 12194.217)  # Hz, IEC 61672-1 annex E
WEIGHTING_OFFSET = 2.000  # dB, makes A(1 kHz) = 0


def a_weighting(frequency: Tensor) -> Tensor:
    """A-weighting (...,) dB at frequency (...,) > 0 Hz. Source: IEC 61672-1:2013, annex E."""
    return 10.0 * torch.log10(a_weighting_factor(frequency))


def a_weighting_factor(frequency: Tensor) -> Tensor:
    """What A-weighting multiplies the squared pressure by, (...,), at frequency (...,) Hz."""
    f1, f2, f3, f4 = (pole**2 for pole in WEIGHTING_POLES)
    f = frequency**2
    response = f4 * f**2 / ((f + f1) * (f + f4) * torch.sqrt((f + f2) * (f + f3)))
    found: Tensor = response**2 * 10.0 ** (WEIGHTING_OFFSET / 10.0)
    return found


def sound_pressure_level(pressure_squared: Tensor) -> Tensor:
    """Level (...,) dB re 20 uPa of a mean squared pressure (...,) Pa^2, floored at -46 dB."""
    return 10.0 * torch.log10((pressure_squared + PRESSURE_FLOOR**2) / REFERENCE_PRESSURE**2)


def squared_pressure(level: Tensor) -> Tensor:
    """Mean squared pressure (...,) Pa^2 of a level (...,) dB."""
    return REFERENCE_PRESSURE**2 * torch.exp(level * (math.log(10.0) / 10.0))


def third_octave_centers(lowest: float = 20.0, highest: float = 20e3) -> Tensor:
    """Exact middle frequencies (band,) Hz of the third-octave bands from `lowest` to `highest` nominal Hz.

    Base ten: 1000 x 10^(j/10). Source: IEC 61260-1:2014. Raises ValueError unless 0 < lowest <= highest.
    """
    if not 0.0 < lowest <= highest:
        raise ValueError(f"lowest = {lowest} Hz is not allowed; it must lie between 0 and highest = {highest} Hz")
    first, last = (round(10.0 * math.log10(edge / 1000.0)) for edge in (lowest, highest))
    return 1000.0 * 10.0 ** (torch.arange(first, last + 1, dtype=torch.float64) / 10.0)


def tones_in_third_octaves(frequency: Tensor, pressure_squared: Tensor, centers: Tensor) -> Tensor:
    """Squared pressures (..., band) Pa^2 of tones (..., tone) at `frequency` (..., tone) Hz, each in the band it falls in.

    The bands jump with frequency: for spectra to look at, not for an optimizer.
    """
    position = 10.0 * torch.log10(frequency[..., None] / centers)
    is_inside = (position >= -0.5) & (position < 0.5)
    share = torch.where(position.isnan(), position, is_inside.to(position))  # an undefined tone is not a silent one
    return (pressure_squared[..., None] * share).sum(-2)


def bands_in_third_octaves(frequency: Tensor, pressure_squared: Tensor, centers: Tensor, thirds: int) -> Tensor:
    """Squared pressures (..., third-octave) Pa^2 of bands `thirds` third-octaves wide centred at `frequency` (..., band) Hz.

    Each band's energy (..., band) is spread evenly over the logarithm of frequency: continuous in `frequency`.
    """
    position = 10.0 * torch.log10(frequency[..., None] / centers)  # in third-octaves
    reach = 0.5 * thirds
    overlap = (torch.clamp(position + reach, max=0.5) - torch.clamp(position - reach, min=-0.5)).clamp(min=0.0)
    return (pressure_squared[..., None] * overlap / thirds).sum(-2)
