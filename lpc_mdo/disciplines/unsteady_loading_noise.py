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

from lpc_mdo.disciplines.tonal_noise import BladeLoading, TonalNoise, barry_magliozzi, require_audible
from lpc_mdo.numerics.bessel import bessel_j, bessel_table


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

    def share(self, order: Tensor) -> Tensor:
        """Amplitude (...,) of loads of `order` (...,), of either sign, over the steady load; none of order zero."""
        size = order.abs()
        return torch.where(size > 0.0, self.fluctuation * size.clamp(min=1.0) ** -self.decay, 0.0)


@dataclass(frozen=True)
class _Geometry:
    """Where the observer stands, harmonic by harmonic."""

    order: Tensor  # (..., harmonic): n = m x blades
    wavenumber: Tensor  # (..., harmonic) 1/m
    sine: Tensor  # (...,) of the angle from the axis
    direction: Tensor  # (...,) what thrust radiates, one straight ahead in hover
    factor: Tensor  # (..., harmonic): wavenumber over 2 sqrt(2) pi x distance

    @classmethod
    def of(
        cls, loading: BladeLoading, axial_distance: Tensor, distance: Tensor, harmonics: int, axial_mach: float
    ) -> "_Geometry":
        require_audible(loading, distance, harmonics)
        m = torch.arange(1, harmonics + 1, dtype=loading.radius.dtype, device=loading.radius.device)
        order, beta = m * loading.blades[..., None], 1.0 - axial_mach**2
        lateral_squared = (distance**2 - axial_distance**2).clamp(min=0.0)
        amplitude = torch.sqrt(axial_distance**2 + beta * lateral_squared)
        wavenumber = order * (loading.rotation_speed / loading.speed_of_sound)[..., None]
        return cls(
            order=order,
            wavenumber=wavenumber,
            sine=torch.sqrt(lateral_squared + (1e-6 * distance) ** 2) / amplitude,
            direction=(axial_mach + axial_distance / amplitude) / beta,
            factor=wavenumber / (2.0 * math.sqrt(2.0) * math.pi * amplitude[..., None]),
        )


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
    geometry = _Geometry.of(loading, axial_distance, distance, harmonics, axial_mach)
    n, r = geometry.order, loading.radius[..., None, None, :]
    bessel_order = n[..., None] - orders  # (..., harmonic, order)
    half_angle = loading.chord * torch.cos(loading.pitch_angle) / (2.0 * loading.radius)
    spread = torch.sinc(bessel_order[..., None] * half_angle[..., None, None, :] / math.pi)
    argument = geometry.wavenumber[..., None, None] * r * geometry.sine[..., None, None, None]
    weight = spread * bessel_j(bessel_order[..., None], argument) * loading.width[..., None, None, :]
    arm = (loading.speed_of_sound / loading.rotation_speed)[..., None, None, None] / r**2
    return _Kernel(
        thrust=geometry.direction[..., None, None, None] * weight,
        torque=-(bessel_order / n[..., None])[..., None] * arm * weight,
        bessel_order=bessel_order,
        factor=geometry.factor,
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

    axial_distance (...,) m along the thrust from hub to observer, distance (...,) m. The phases between orders are taken as random: energies add. Every order s = n - q is summed whose J_q is not
    negligible.
    """
    law = law or LoadingLaw()
    steady = barry_magliozzi(loading, axial_distance, distance, harmonics, axial_mach)
    geometry = _Geometry.of(loading, axial_distance, distance, harmonics, axial_mach)
    r, width = loading.radius, loading.width
    argument = (
        geometry.wavenumber[..., None] * geometry.sine[..., None, None] * r[..., None, :]
    )  # (..., harmonic, station)
    reach = float(argument.detach().nan_to_num(0.0).max()) if argument.numel() else 0.0
    highest = math.ceil(reach + 6.0 * (1.0 + reach ** (1.0 / 3.0)))  # J_q < 1e-9 beyond
    q = torch.arange(highest + 1, dtype=r.dtype, device=r.device)
    half_angle = loading.chord * torch.cos(loading.pitch_angle) / (2.0 * r)
    spread = torch.sinc(half_angle[..., None] * q / math.pi) * width[..., None]  # (..., station, q)
    table = bessel_table(argument, highest)  # (..., harmonic, station, q)
    arm = (loading.speed_of_sound / loading.rotation_speed)[..., None] / r**2
    thrust, drag = (
        (table * (load[..., None] * spread)[..., None, :, :]).sum(-2)
        for load in (geometry.direction[..., None] * loading.thrust_per_length, arm * loading.torque_per_length)
    )
    n = geometry.order[..., None]  # (..., harmonic, 1)
    drag = q / n * drag
    # J_-q = (-1)^q J_q: orders n - q and n + q share their Bessel functions, and differ in the sign of the drag.
    energy = (law.share(n - q) * (thrust - drag)) ** 2
    mirrored = (law.share(n + q) * (thrust + drag)) ** 2
    unsteady = geometry.factor**2 * (energy.sum(-1) + mirrored[..., 1:].sum(-1))
    return TonalNoise(steady.frequency, steady.loading + unsteady, steady.thickness)


def _two_sided(amplitudes: Tensor) -> Tensor:
    """Orders 0 ... N (..., N + 1, station) to -N ... N of a real signal."""
    return torch.cat([amplitudes[..., 1:, :].flip(-2).conj(), amplitudes], dim=-2)
