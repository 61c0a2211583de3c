"""Steady loading and thickness noise of rotors at harmonics of the blade-passing frequency.

Source: Barry and Magliozzi, AFAPL-TR-71-37, on the basis of Garrick and Watkins, NACA Rep. 1198, and Gutin, NACA TM 1195;
far field, without their near-field term, whose in-phase addition overstates it. A steady ring of sources is constant in
time on the rotor's axis: these tones vanish there, and so does the sense of a limit on them alone.
"""

import math
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lpc_mdo.numerics.bessel import bessel_j

SECTION_AREA_FACTOR = 0.6853  # section area over chord x thickness of four-digit NACA sections


@dataclass(frozen=True)
class BladeLoading:
    """What the blades of a rotor do to the air; leading dimensions batch (rotors, observers)."""

    radius: Tensor  # (..., station) m
    width: Tensor  # (..., station or 1) m, radial extent of each station
    thrust_per_length: Tensor  # (..., station) N/m, all blades together
    torque_per_length: Tensor  # (..., station) N, all blades together
    chord: Tensor  # (..., station) m
    thickness_to_chord: Tensor | float  # (rotor, station), or one number for all
    pitch_angle: Tensor  # (..., station) rad
    blades: Tensor  # (...,)
    rotation_speed: Tensor  # (...,) rad/s
    density: Tensor  # (...,) kg/m^3
    speed_of_sound: Tensor  # (...,) m/s

    def per_observer(self) -> "BladeLoading":
        """The same with a dimension for observers before the last, the rotors': (..., 1, rotor[, station])."""
        names = ("blades", "rotation_speed", "density", "speed_of_sound")
        stations = ("radius", "width", "thrust_per_length", "torque_per_length", "chord", "pitch_angle")
        wider = {name: getattr(self, name).unsqueeze(-2) for name in names}
        return replace(self, **wider, **{name: getattr(self, name).unsqueeze(-3) for name in stations})


@dataclass(frozen=True)
class TonalNoise:
    """Mean squared pressures (..., harmonic) Pa^2 at `frequency` (..., harmonic) Hz."""

    frequency: Tensor
    loading: Tensor
    thickness: Tensor

    @property
    def pressure_squared(self) -> Tensor:
        """Loading and thickness are 90 degrees out of phase: their energies add."""
        return self.loading + self.thickness


def require_audible(loading: BladeLoading, distance: Tensor, harmonics: int) -> None:
    """Raises ValueError unless there is a harmonic, every rotor (...,) turns and no observer, at `distance` (...,) m, is at it."""
    if harmonics < 1:
        raise ValueError(f"harmonics = {harmonics} is not allowed; it must be at least 1")
    for name, value in (("rotation_speed", loading.rotation_speed), ("distance", distance)):
        if bool((value <= 0.0).any()):
            raise ValueError(f"{name} = {float(value.detach().min()):g} is invalid: it must be above 0 for every rotor")


def barry_magliozzi(
    loading: BladeLoading, axial_distance: Tensor, distance: Tensor, harmonics: int, axial_mach: float = 0.0
) -> TonalNoise:
    """Tones m = 1 ... harmonics at an observer `distance` (...,) m from the hub.

    axial_distance (...,) m along the thrust: positive ahead of the disk, negative below a lift rotor. In flight along
    the axis at axial_mach the observer moves with the rotor. Raises ValueError as `require_audible`.
    """
    require_audible(loading, distance, harmonics)
    m = torch.arange(1, harmonics + 1, dtype=loading.radius.dtype, device=loading.radius.device)
    order = m * loading.blades[..., None]  # (..., harmonic)
    speed, sound, beta = loading.rotation_speed[..., None], loading.speed_of_sound[..., None], 1.0 - axial_mach**2
    wavenumber = order * speed / sound
    lateral_squared = (distance**2 - axial_distance**2).clamp(min=0.0)
    lateral = torch.sqrt(lateral_squared + (1e-6 * distance) ** 2)
    amplitude = torch.sqrt(axial_distance**2 + beta * lateral_squared)[..., None]
    along = axial_distance[..., None]

    r, width = loading.radius[..., None, :], loading.width[..., None, :]  # (..., 1, station)
    chord = loading.chord[..., None, :]
    spread = torch.sinc(order[..., None] * chord * torch.cos(loading.pitch_angle[..., None, :]) / (2.0 * math.pi * r))
    argument = wavenumber[..., None] * r * (lateral[..., None] / amplitude)[..., None]
    weight = spread * bessel_j(order[..., None], argument) * width  # (..., harmonic, station)

    direction = (axial_mach + along / amplitude) / beta
    source = direction[..., None] * loading.thrust_per_length[..., None, :] - (sound / speed)[..., None] * (
        loading.torque_per_length[..., None, :] / r**2
    )
    factor = wavenumber / (2.0 * math.sqrt(2.0) * math.pi * amplitude)
    loading_pressure = factor * (source * weight).sum(-1)

    section = (SECTION_AREA_FACTOR * loading.thickness_to_chord * loading.chord**2)[..., None, :]
    thickness_factor = (
        loading.density[..., None]
        * (m * speed) ** 2
        * loading.blades[..., None] ** 3
        * (amplitude + axial_mach * along) ** 2
        / (2.0 * math.sqrt(2.0) * math.pi * beta**2 * amplitude**3)
    )
    thickness_pressure = thickness_factor * (section * weight).sum(-1)
    return TonalNoise(order * speed / (2.0 * math.pi), loading_pressure**2, thickness_pressure**2)
