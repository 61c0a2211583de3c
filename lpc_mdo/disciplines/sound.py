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
    return response**2 * 10.0 ** (WEIGHTING_OFFSET / 10.0)


def sound_pressure_level(pressure_squared: Tensor) -> Tensor:
    """Level (...,) dB re 20 uPa of a mean squared pressure (...,) Pa^2, floored at -46 dB."""
    return 10.0 * torch.log10((pressure_squared + PRESSURE_FLOOR**2) / REFERENCE_PRESSURE**2)


def squared_pressure(level: Tensor) -> Tensor:
    """Mean squared pressure (...,) Pa^2 of a level (...,) dB."""
    return REFERENCE_PRESSURE**2 * torch.exp(level * (math.log(10.0) / 10.0))
