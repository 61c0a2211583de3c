"""Broadband noise of hovering rotors strip by strip: airfoil self-noise in the motion of the blades, averaged over a turn."""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from lpc_mdo.disciplines.airfoil_self_noise import (
    BoundaryLayer,
    Listener,
    Section,
    laminar_vortex_noise,
    tip_vortex_noise,
    trailing_edge_noise,
)
from lpc_mdo.disciplines.atmosphere import GAS_CONSTANT, HEAT_CAPACITY_RATIO, sutherland_viscosity
from lpc_mdo.disciplines.broadband_noise import BroadbandNoise
from lpc_mdo.disciplines.sound import third_octave_centers
from lpc_mdo.disciplines.tonal_noise import BladeLoading

Source = Callable[
    [Section, Listener, Tensor], Tensor
]  # strip, observer, frequencies (..., band) Hz to Pa^2 (..., band)
AZIMUTHS = 16
ZERO_LIFT_ANGLE = -0.0724  # rad, NACA 4412: -4.15 deg, thin-airfoil theory


def rotor_self_noise(
    loading: BladeLoading,
    angle_of_attack: Tensor,
    arm: Tensor,
    *,
    zero_lift_angle: float = ZERO_LIFT_ANGLE,
    boundary_layer: BoundaryLayer = "tripped",
    azimuths: int = AZIMUTHS,
) -> BroadbandNoise:
    """Third-octave noise from 20 Hz to 20 kHz of rotors that hover with thrust along z.

    angle_of_attack (..., station) rad from the chord line; arm (..., 3) m from hub to observer, which may have more leading
    dimensions than the loading. Every strip sounds as in `airfoil_self_noise`, the outermost with the vortex of a rounded tip;
    untripped blades with vortices of their laminar boundary layer, too. Raises ValueError for another boundary layer and unless
    azimuths >= 1.
    """
    section = blade_strips(loading, angle_of_attack - zero_lift_angle)

    def edge(strip: Section, listener: Listener, frequency: Tensor) -> Tensor:
        energy = trailing_edge_noise(strip, listener, frequency, boundary_layer).total
        if boundary_layer == "untripped":
            energy = energy + laminar_vortex_noise(strip, listener, frequency)
        return energy

    centers = third_octave_centers().to(arm)
    bands = heard_over_a_turn(loading, section, arm, centers, edge, azimuths)
    outermost = slice(-1, None)
    bands = bands + heard_over_a_turn(loading, section, arm, centers, tip_vortex_noise, azimuths, outermost)
    return BroadbandNoise(bands.sum(-1), centers, bands, thirds=1)


def blade_strips(loading: BladeLoading, angle_of_attack: Tensor) -> Section:
    """The blades' strips (..., station) at angle_of_attack (..., station) rad from zero lift; inflow is left out of their speed."""
    temperature = loading.speed_of_sound**2 / (HEAT_CAPACITY_RATIO * GAS_CONSTANT)
    return Section(
        speed=loading.rotation_speed[..., None] * loading.radius,
        chord=loading.chord,
        span=loading.width.expand_as(loading.radius),
        angle_of_attack=angle_of_attack,
        speed_of_sound=loading.speed_of_sound[..., None],
        kinematic_viscosity=(sutherland_viscosity(temperature) / loading.density)[..., None],
    )


def heard_over_a_turn(
    loading: BladeLoading,
    section: Section,
    arm: Tensor,
    frequency: Tensor,
    source: Source,
    azimuths: int = AZIMUTHS,
    stations: slice = slice(None),
) -> Tensor:
    """Squared pressure (..., band) Pa^2 that an observer hears at `frequency` (band,) Hz of all blades' strips in `stations`.

    Sound of frequency f (1 - M_r) at the blade is heard at f, and the observer's time passes by 1 - M_r of the blade's, M_r the
    strip's Mach number towards the observer. Strips and blades add incoherently. Source: Brooks and Burley, AIAA 2001-2210, but
    for the directivity, which stays that of the section's report. Raises ValueError unless azimuths >= 1.
    """
    if azimuths < 1:
        raise ValueError(f"azimuths = {azimuths} is not allowed; it must be at least 1")
    strips = Section(*(v[..., stations] if v.shape[-1] > 1 else v for v in vars(section).values()))
    total = torch.zeros(*arm.shape[:-1], len(frequency), dtype=arm.dtype, device=arm.device)
    for step in range(azimuths):
        azimuth = 2.0 * math.pi * (step + 0.5) / azimuths
        listener, approach = _heard_from(loading, strips, arm, azimuth, stations)
        stretch = (1.0 - approach)[..., None]
        total = total + (source(strips, listener, frequency * stretch) * stretch).sum(-2)
    return total * (loading.blades / azimuths)[..., None]


def _heard_from(
    loading: BladeLoading, strips: Section, arm: Tensor, azimuth: float, stations: slice
) -> tuple[Listener, Tensor]:
    """The observer as the strips (..., station) see it, and their Mach numbers towards it, with the blade at `azimuth` rad."""
    outward, forward = (
        arm.new_tensor([math.cos(angle), math.sin(angle), 0.0]) for angle in (azimuth, azimuth + 0.5 * math.pi)
    )
    path = arm[..., None, :] - loading.radius[..., stations, None] * outward
    distance = torch.linalg.vector_norm(path, dim=-1)
    along_span, ahead, above = (part / distance for part in (path @ outward, path @ forward, path[..., 2]))
    pitch = loading.pitch_angle[..., stations]
    sin, cos = torch.sin(pitch), torch.cos(pitch)
    downstream, normal = -cos * ahead - sin * above, cos * above - sin * ahead
    share = normal**2 / (normal**2 + along_span**2 + 1e-12)
    return Listener(distance, downstream, share), strips.mach * ahead
