"""Noise that an airfoil makes in smooth flow: turbulent and laminar boundary layers at the trailing edge, stall, and the tip.

Scaling laws fitted to measurements of NACA 0012 sections in third-octave bands. Source: Brooks, Pope and Marcolini, Airfoil
Self-Noise and Prediction, NASA RP-1218 (1989); equations by their numbers there. Angles in its fits are degrees from zero lift,
either sign alike. Noise of blunt trailing edges is left out: it hangs on the edge's thickness, which a design here has not.
The fits are piecewise: continuous to the digits of their constants, with kinks between the pieces.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from lpc_mdo.disciplines.sound import squared_pressure

BoundaryLayer = Literal["tripped", "untripped"]
CONVECTION = 0.8  # speed of the turbulence over that of the stream, p. 105
LEAST_ANGLE = 1e-3  # deg: keeps the tip's vortex from vanishing


@dataclass(frozen=True)
class Section:
    """A strip of blade or wing, each (...,)."""

    speed: Tensor  # m/s
    chord: Tensor  # m
    span: Tensor  # m
    angle_of_attack: Tensor  # rad from zero lift
    speed_of_sound: Tensor  # m/s
    kinematic_viscosity: Tensor  # m^2/s

    @property
    def mach(self) -> Tensor:
        return self.speed / self.speed_of_sound

    @property
    def reynolds(self) -> Tensor:
        return self.speed * self.chord / self.kinematic_viscosity

    @property
    def degrees(self) -> Tensor:
        return torch.rad2deg(self.angle_of_attack.abs())


@dataclass(frozen=True)
class Listener:
    """Where the observer is as the trailing edge sees it, each (...,)."""

    distance: Tensor  # m
    downstream_cosine: Tensor  # of the angle from the stream's direction
    normal_share: Tensor  # square of the sine of the angle from the span, in the plane across the stream

    def high_frequency(self, mach: Tensor) -> Tensor:
        """Directivity of a half plane, eq. B1; 1 above an edge at rest."""
        cosine = self.downstream_cosine
        convection = (1.0 + mach * cosine) * (1.0 + (1.0 - CONVECTION) * mach * cosine) ** 2
        return (1.0 - cosine) * self.normal_share / convection

    def low_frequency(self, mach: Tensor) -> Tensor:
        """Directivity of a compact dipole, eq. B2."""
        cosine = self.downstream_cosine
        return (1.0 - cosine**2) * self.normal_share / (1.0 + mach * cosine) ** 4


@dataclass(frozen=True)
class TrailingEdgeNoise:
    """Squared pressures (..., band) Pa^2 of a turbulent boundary layer's three parts."""

    pressure_side: Tensor
    suction_side: Tensor
    separation: Tensor

    @property
    def total(self) -> Tensor:
        return self.pressure_side + self.suction_side + self.separation


def displacement_thickness(section: Section, boundary_layer: BoundaryLayer) -> tuple[Tensor, Tensor]:
    """Of pressure and suction side (...,) m at the trailing edge; heavily tripped or not, eqs. 2 to 16.

    Raises ValueError for another boundary layer.
    """
    log, alpha = torch.log10(section.reynolds), section.degrees
    if boundary_layer == "tripped":
        thick = 10.0 ** (3.411 - 1.5397 * log + 0.1059 * log**2)
        rest = torch.where(section.reynolds <= 0.3e6, 0.0601 * section.reynolds**-0.114, thick)
        growth = _pieces(
            alpha,
            (5.0, 12.5),
            10.0 ** (0.0679 * alpha),
            0.381 * 10.0 ** (0.1516 * alpha),
            14.296 * 10.0 ** (0.0258 * alpha),
        )
    elif boundary_layer == "untripped":
        rest = 10.0 ** (3.0187 - 1.5397 * log + 0.1059 * log**2)
        growth = _pieces(
            alpha,
            (7.5, 12.5),
            10.0 ** (0.0679 * alpha),
            0.0162 * 10.0 ** (0.3066 * alpha),
            52.42 * 10.0 ** (0.0258 * alpha),
        )
    else:
        raise ValueError(f"boundary_layer = {boundary_layer!r} is not allowed; it must be 'tripped' or 'untripped'")
    pressure = 10.0 ** (-0.0432 * alpha + 0.00113 * alpha**2)
    return section.chord * rest * pressure, section.chord * rest * growth


def trailing_edge_noise(
    section: Section, listener: Listener, frequency: Tensor, boundary_layer: BoundaryLayer
) -> TrailingEdgeNoise:
    """Turbulent boundary layers passing the edge, and separated flow, at the middles (..., band) Hz of third-octave bands.

    Eqs. 24 to 49. Beyond stall the separated flow alone is heard, as the whole chord's dipole.
    """
    mach, reynolds, alpha = section.mach, section.reynolds, section.degrees
    pressure, suction = displacement_thickness(section, boundary_layer)
    strouhal_1 = 0.02 * mach**-0.6
    # Held where the exponent of the piece in use ends, lest the unused one overflows.
    strouhal_2 = strouhal_1 * _pieces(
        alpha, (1.33, 12.5), torch.ones_like(alpha), 10.0 ** (0.0054 * (alpha.clamp(max=12.5) - 1.33) ** 2), 4.72
    )
    amplitude = _amplitude(reynolds)
    power = mach**5 * section.span / listener.distance**2
    high, low = power * listener.high_frequency(mach), power * listener.low_frequency(mach)
    pressure_reynolds = section.speed * pressure / section.kinematic_viscosity
    gain = alpha * (1.43 * torch.log10(pressure_reynolds) - 5.29)
    gain = torch.where(pressure_reynolds <= 5000.0, gain, 0.0)  # eq. 48
    separated = _separation_amplitude(alpha, mach, amplitude)
    strouhal = frequency / section.speed[..., None]
    of_pressure, of_suction = strouhal * pressure[..., None], strouhal * suction[..., None]
    is_stalled = (alpha > torch.clamp(23.43 * mach + 4.651, max=12.5))[..., None]

    def heard(level: Tensor, thickness: Tensor, directivity: Tensor) -> Tensor:
        return squared_pressure(level) * (thickness * directivity)[..., None]

    shape = _spectrum_a(of_pressure / strouhal_1[..., None], reynolds)
    lower = heard(shape + (amplitude - 3.0 + gain)[..., None], pressure, high)
    shape = _spectrum_a(of_suction / (0.5 * (strouhal_1 + strouhal_2))[..., None], reynolds)
    upper = heard(shape + (amplitude - 3.0)[..., None], suction, high)
    ratio, level = of_suction / strouhal_2[..., None], separated[..., None]
    attached = heard(_spectrum_b(ratio, reynolds) + level, suction, high)
    stalled = heard(_spectrum_a(ratio, 3.0 * reynolds) + level, suction, low)
    return TrailingEdgeNoise(
        pressure_side=torch.where(is_stalled, 0.0, lower),
        suction_side=torch.where(is_stalled, 0.0, upper),
        separation=torch.where(is_stalled, stalled, attached),
    )


def laminar_vortex_noise(section: Section, listener: Listener, frequency: Tensor) -> Tensor:
    """Vortices shed by a laminar boundary layer (..., band) Pa^2 in third-octaves at `frequency` (..., band) Hz, eqs. 53 to 60."""
    mach, reynolds, alpha = section.mach, section.reynolds, section.degrees
    log = torch.log10(reynolds)
    thickness = section.chord * 10.0 ** (1.6569 - 0.9045 * log + 0.0596 * log**2 - 0.04175 * alpha + 0.00106 * alpha**2)
    peak = _pieces(reynolds, (1.3e5, 4e5), torch.full_like(reynolds, 0.18), 0.001756 * reynolds**0.3931, 0.28)
    peak = peak * 10.0 ** (-0.04 * alpha)
    critical = torch.where(alpha <= 3.0, 10.0 ** (0.215 * alpha + 4.978), 10.0 ** (0.120 * alpha + 5.263))
    e = torch.log10((frequency / section.speed[..., None]) * (thickness / peak)[..., None])
    at = (0.5974, 0.8545, 1.17, 1.674)
    shape = _pieces(
        e,
        tuple(math.log10(value) for value in at),
        39.8 * e - 11.12,
        98.409 * e + 2.0,
        -5.076 + _root(2.484 - 506.25 * e**2),
        -98.409 * e + 2.0,
        -39.8 * e - 11.12,
    )
    d = torch.log10(reynolds / critical)
    at = (0.3237, 0.5689, 1.7579, 3.0889)
    amplitude = _pieces(
        d,
        tuple(math.log10(value) for value in at),
        77.852 * d + 15.328,
        65.188 * d + 9.125,
        -114.052 * d**2,
        -65.188 * d + 9.125,
        -77.852 * d + 15.328,
    )
    level = shape + (amplitude + 171.04 - 3.03 * alpha)[..., None]
    strength = thickness * mach**5 * section.span * listener.high_frequency(mach) / listener.distance**2
    return squared_pressure(level) * strength[..., None]


def tip_vortex_noise(section: Section, listener: Listener, frequency: Tensor) -> Tensor:
    """Vortex of a rounded tip (..., band) Pa^2 in third-octaves at `frequency` (..., band) Hz, eqs. 61 to 67.

    The section is the tip; its span does not enter. Lift is taken to end as in the report's models of large aspect ratio.
    """
    mach, alpha = section.mach, section.degrees.clamp(min=LEAST_ANGLE)
    extent = 0.008 * alpha * section.chord
    fastest = (1.0 + 0.036 * alpha) * mach
    strouhal = frequency * (extent / (fastest * section.speed_of_sound))[..., None]
    strength = mach**2 * fastest**3 * extent**2 * listener.high_frequency(mach) / listener.distance**2
    return squared_pressure(126.0 - 30.5 * (torch.log10(strouhal) + 0.3) ** 2) * strength[..., None]


def _amplitude(reynolds: Tensor) -> Tensor:
    """K1 dB, eq. 47."""
    log = torch.log10(reynolds)
    return _pieces(reynolds, (2.47e5, 8e5), -4.31 * log + 156.3, -9.0 * log + 181.6, 128.5)


def _separation_amplitude(alpha: Tensor, mach: Tensor, amplitude: Tensor) -> Tensor:
    """K2 dB, eqs. 49 and 50: an ellipse over the angle of attack."""
    half_width, height = 27.094 * mach + 3.31, 72.65 * mach + 10.74
    middle, offset = 23.43 * mach + 4.651, -34.19 * mach - 13.82
    share = (alpha - middle) / half_width
    within = height * _root(1.0 - share**2) + offset
    return amplitude + torch.where(share < -1.0, -1000.0, torch.where(share > 1.0, -12.0, within))


def _spectrum_a(ratio: Tensor, reynolds: Tensor) -> Tensor:
    """A(a) dB (..., band), eqs. 35 to 40."""
    a0 = _crossing(reynolds, 0.57, -9.57e-13, 1.13)
    return _between(_least_a, _most_a, torch.log10(ratio).abs(), a0)


def _spectrum_b(ratio: Tensor, reynolds: Tensor) -> Tensor:
    """B(b) dB (..., band), eqs. 41 to 46."""
    b0 = _crossing(reynolds, 0.30, -4.48e-13, 0.56)
    return _between(_least_b, _most_b, torch.log10(ratio).abs(), b0)


def _crossing(reynolds: Tensor, least: float, curvature: float, most: float) -> Tensor:
    """Where the spectrum has fallen by 20 dB (...,), eqs. 38 and 44."""
    curved = curvature * (reynolds - 8.57e5) ** 2 + most
    return _pieces(reynolds, (9.52e4, 8.57e5), torch.full_like(reynolds, least), curved, most)


def _between(
    least: Callable[[Tensor], Tensor], most: Callable[[Tensor], Tensor], at: Tensor, crossing: Tensor
) -> Tensor:
    low, high = least(crossing), most(crossing)
    share = ((-20.0 - low) / (high - low))[..., None]
    return least(at) + share * (most(at) - least(at))


def _least_a(a: Tensor) -> Tensor:
    return _pieces(
        a,
        (0.204, 0.244),
        _root(67.552 - 886.788 * a**2) - 8.219,
        -32.665 * a + 3.981,
        -142.795 * a**3 + 103.656 * a**2 - 57.757 * a + 6.006,
    )


def _most_a(a: Tensor) -> Tensor:
    return _pieces(
        a,
        (0.13, 0.321),
        _root(67.552 - 886.788 * a**2) - 8.219,
        -15.901 * a + 1.098,
        -4.669 * a**3 + 3.491 * a**2 - 16.699 * a + 1.149,
    )


def _least_b(b: Tensor) -> Tensor:
    return _pieces(
        b,
        (0.13, 0.145),
        _root(16.888 - 886.788 * b**2) - 4.109,
        -83.607 * b + 8.138,
        -817.81 * b**3 + 355.21 * b**2 - 135.024 * b + 10.619,
    )


def _most_b(b: Tensor) -> Tensor:
    return _pieces(
        b,
        (0.10, 0.187),
        _root(16.888 - 886.788 * b**2) - 4.109,
        -31.33 * b + 1.854,
        -80.541 * b**3 + 44.174 * b**2 - 39.381 * b + 2.344,
    )


def _pieces(x: Tensor, ends: tuple[float, ...], *values: Tensor | float) -> Tensor:
    """values[k] where x lies between the k-th and the next of `ends`; an undefined x stays so."""
    result = torch.as_tensor(values[-1], dtype=x.dtype, device=x.device)
    for end, value in zip(reversed(ends), reversed(values[:-1]), strict=True):
        result = torch.where(x <= end, value, result)
    return torch.where(x.isnan(), x, result)


def _root(x: Tensor) -> Tensor:
    """Square root that is zero, with no slope, where its piece of the fit is not in use."""
    is_positive = x > 0.0
    return torch.where(is_positive, torch.sqrt(torch.where(is_positive, x, 1.0)), 0.0)
