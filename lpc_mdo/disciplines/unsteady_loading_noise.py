"""Rotor tones from blade loads that vary around the turn: they do not vanish on the rotor's axis.

A load that repeats s times a turn radiates at n = m x blades times the rotation speed through the Bessel function of order
n - s; on the axis only s = n is left. Steady loads, s = 0, give the far field of `tonal_noise` again. Source: Lowson, Proc.
R. Soc. A 286 (1965); Lowson and Ollerhead, J. Sound Vib. 9 (1969) and USAAVLABS TR 68-60; in flight along the axis as
Hanson, AIAA J. 18 (1980). Radial forces are left out.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.tonal_noise import BladeLoading, TonalNoise, barry_magliozzi
from lpc_mdo.numerics.bessel import bessel_j


@dataclass(frozen=True)
class LoadingHarmonics:
    """Complex amplitudes of order s = 0 ... of what each blade carries at azimuth psi, all blades together.

    dT/dr (psi) = sum over s from -orders to orders of thrust_s exp(i s psi), thrust_-s = conj(thrust_s), psi counted in
    the direction of rotation; likewise dQ/dr.
    """

    thrust_per_length: Tensor  # (..., order, station) N/m
    torque_per_length: Tensor  # (..., order, station) N


@dataclass(frozen=True)
class LoadingLaw:
    """Amplitude of order s over the steady load: fluctuation x s^-decay, thrust and torque alike.

    Lowson and Ollerhead fitted a decay of 2, and 2.5 with the loss of spanwise coherence, to helicopters whose rotors cut
    their wakes, with a fluctuation of order one. A few per cent for clean hover is assumed, for want of measurements.
    """

    fluctuation: float = 0.05
    decay: float = 2.0


@dataclass(frozen=True)
class _Kernel:
    """What unit loads of order s radiate, (..., harmonic, order, station); wavenumber over distance (..., harmonic)."""

    thrust: Tensor
    torque: Tensor
    bessel_order: Tensor  # (..., harmonic, order): n - s
    factor: Tensor


def _kernel(
    loading: BladeLoading, orders: Tensor, axial_distance: Tensor, distance: Tensor, harmonics: int, axial_mach: float
) -> _Kernel:
    if harmonics < 1:
        raise ValueError(f"harmonics = {harmonics} is not allowed; it must be at least 1")
    m = torch.arange(1, harmonics + 1, dtype=loading.radius.dtype, device=loading.radius.device)
    n = m * loading.blades[..., None]
    speed, sound, beta = loading.rotation_speed[..., None], loading.speed_of_sound[..., None], 1.0 - axial_mach**2
    lateral_squared = (distance**2 - axial_distance**2).clamp(min=0.0)
    lateral = torch.sqrt(lateral_squared + (1e-6 * distance) ** 2)
    amplitude = torch.sqrt(axial_distance**2 + beta * lateral_squared)
    direction = (axial_mach + axial_distance / amplitude) / beta
    wavenumber = n * speed / sound

    r = loading.radius[..., None, None, :]
    bessel_order = n[..., None] - orders  # (..., harmonic, order)
    half_angle = loading.chord * torch.cos(loading.pitch_angle) / (2.0 * loading.radius)
    spread = torch.sinc(bessel_order[..., None] * half_angle[..., None, None, :] / math.pi)
    argument = wavenumber[..., None, None] * r * (lateral / amplitude)[..., None, None, None]
    # Bessel functions are the costly part: the argument knows no order, hence the expansion here.
    bessel = bessel_j(bessel_order[..., None], argument.expand(*argument.shape[:-2], len(orders), r.shape[-1]))
    weight = spread * bessel * loading.width[..., None, None, :]
    arm = (sound / speed)[..., None, None] / r**2
    return _Kernel(
        thrust=direction[..., None, None, None] * weight,
        torque=-(bessel_order / n[..., None])[..., None] * arm * weight,
        bessel_order=bessel_order,
        factor=wavenumber / (2.0 * math.sqrt(2.0) * math.pi * amplitude[..., None]),
    )


def loading_harmonics_noise(
    loading: BladeLoading,
    unsteady: LoadingHarmonics,
    axial_distance: Tensor,
    distance: Tensor,
    azimuth: Tensor,
    harmonics: int,
    axial_mach: float = 0.0,
) -> Tensor:
    """Mean squared pressures (..., harmonic) Pa^2 of blade loads with known phases.

    azimuth (...,) rad of the observer, in the direction of rotation from where psi = 0. Geometry, speeds and blade number
    come from `loading`, the loads from `unsteady`; the rest as `barry_magliozzi`.
    """
    highest = unsteady.thrust_per_length.shape[-2] - 1
    orders = torch.arange(-highest, highest + 1, dtype=loading.radius.dtype, device=loading.radius.device)
    kernel = _kernel(loading, orders, axial_distance, distance, harmonics, axial_mach)
    thrust, torque = (_two_sided(part) for part in (unsteady.thrust_per_length, unsteady.torque_per_length))
    radiated = (kernel.thrust * thrust[..., None, :, :] + kernel.torque * torque[..., None, :, :]).sum(-1)
    phase = kernel.bessel_order * (0.5 * math.pi - azimuth[..., None, None])
    pressure = kernel.factor * (radiated * torch.polar(torch.ones_like(phase), phase)).sum(-1)
    return pressure.real**2 + pressure.imag**2


def lowson_noise(
    loading: BladeLoading,
    axial_distance: Tensor,
    distance: Tensor,
    harmonics: int,
    law: LoadingLaw | None = None,
    axial_mach: float = 0.0,
) -> TonalNoise:
    """Tones of steady loads, thickness and load fluctuations after `law`, in the signature of `barry_magliozzi`.

    The phases between orders are taken as random: energies add. Orders up to twice the highest harmonic are summed.
    """
    law = law or LoadingLaw()
    steady = barry_magliozzi(loading, axial_distance, distance, harmonics, axial_mach)
    highest = 2 * harmonics * int(loading.blades.max())
    positive = torch.arange(1, highest + 1, dtype=loading.radius.dtype, device=loading.radius.device)
    orders = torch.cat([-positive.flip(0), positive])
    kernel = _kernel(loading, orders, axial_distance, distance, harmonics, axial_mach)
    radiated = (
        kernel.thrust * loading.thrust_per_length[..., None, None, :]
        + kernel.torque * loading.torque_per_length[..., None, None, :]
    ).sum(-1)
    share = law.fluctuation * orders.abs() ** -law.decay
    unsteady = kernel.factor**2 * ((share * radiated) ** 2).sum(-1)
    return TonalNoise(steady.frequency, steady.loading + unsteady, steady.thickness)


def _two_sided(amplitudes: Tensor) -> Tensor:
    """Orders 0 ... N (..., N + 1, station) to -N ... N of a real signal."""
    return torch.cat([amplitudes[..., 1:, :].flip(-2).conj(), amplitudes], dim=-2)
