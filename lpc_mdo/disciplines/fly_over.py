"""What is heard on the ground of rotors that fly past along their own axis: loudest level and exposure of a straight flight.

Sound that reaches a fixed observer left the rotor earlier, at the emission point. With the angle from the flight direction
there, cos(a), the present position, for which the tones in flight are written, lies at r (cos(a) - M) along and r sin(a) across,
and tones arrive at f/(1 - M cos(a)). Source: Garrick and Watkins, NACA Rep. 1198 (1954); Dowling and Ffowcs Williams, Sound and
Sources of Sound (1983), chapter 9. Exposure: ISO 1996-1, energy over time, re one second.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.absorption import transmitted_share
from lpc_mdo.disciplines.broadband_noise import schlegel_king_mull
from lpc_mdo.disciplines.noise_map import Absorption
from lpc_mdo.disciplines.sound import a_weighting_factor, sound_pressure_level
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi

HARMONICS = 10
OBSERVERS_AT_ONCE = 64  # bounds the memory of large grids


@dataclass(frozen=True)
class FlightSource:
    """One rotor, or several (..., rotor), that pull along the flight direction."""

    loading: BladeLoading  # (rotor, station)
    thrust: Tensor  # (rotor,) N
    radius: Tensor  # (rotor,) m
    projected_thickness: Tensor  # (rotor,) m, blade thickness across the flow at 0.7 R
    hubs: Tensor  # (rotor, 3) m from the point of the path


@dataclass(frozen=True)
class FlyOver:
    """At each observer (...,)."""

    maximum_dba: Tensor  # dB(A)
    exposure_dba: Tensor  # dB(A) re 1 s: the level of one second that holds as much energy
    level_dba: Tensor  # (..., time) as sound emitted at the given times arrives


def fly_over(
    source: FlightSource,
    velocity: Tensor,
    start: Tensor,
    time: Tensor,
    observers: Tensor,
    absorption: Absorption = torch.zeros_like,
) -> FlyOver:
    """Flight from `start` (3,) m at constant velocity (3,) m/s, heard at observers (..., 3) m.

    time (emission,) s, increasing, at which sound is emitted; observers stand still. Steady loading, thickness and
    Schlegel-King-Mull broadband noise, A-weighted and absorbed at the frequencies heard; rotors add incoherently; the ground's
    reflection is left out. Raises ValueError unless the flight is subsonic and there are two or more times.
    """
    speed = torch.linalg.vector_norm(velocity)
    mach = float(speed / source.loading.speed_of_sound.min())
    if not 0.0 < mach < 1.0:
        raise ValueError(
            f"velocity of {float(speed):g} m/s is not allowed; it must lie between 0 and the speed of sound"
        )
    if time.numel() < 2:
        raise ValueError(f"time has {time.numel()} values; it must have two or more")
    places = observers.reshape(-1, 3)
    parts = [
        _heard(source, velocity, speed, mach, start, time, some, absorption) for some in places.split(OBSERVERS_AT_ONCE)
    ]
    shape = observers.shape[:-1]
    maximum, exposure, level = (torch.cat(part) for part in zip(*parts, strict=True))
    return FlyOver(maximum.reshape(shape), exposure.reshape(shape), level.reshape(*shape, -1))


def _heard(
    source: FlightSource,
    velocity: Tensor,
    speed: Tensor,
    mach: float,
    start: Tensor,
    time: Tensor,
    observers: Tensor,
    absorption: Absorption,
) -> tuple[Tensor, Tensor, Tensor]:
    """Loudest level and exposure (observer,), and levels (observer, time)."""
    hubs = start + velocity * time[:, None, None] + source.hubs  # (time, rotor, 3)
    arm = observers[:, None, None, :] - hubs
    path = torch.linalg.vector_norm(arm, dim=-1)  # (observer, time, rotor)
    cosine = (arm @ (velocity / speed)) / path
    doppler = 1.0 / (1.0 - mach * cosine)
    along, across = path * (cosine - mach), path * torch.sqrt((1.0 - cosine**2).clamp(min=0.0))
    tones = barry_magliozzi(source.loading, along, torch.sqrt(along**2 + across**2), HARMONICS, axial_mach=mach)
    loading = source.loading
    broadband = schlegel_king_mull(
        thrust=source.thrust,
        radius=source.radius,
        tip_speed=loading.rotation_speed * source.radius,
        blade_area=loading.blades * (loading.chord * loading.width).sum(-1),
        density=loading.density,
        elevation_sine=cosine.abs(),
        distance=path,
        projected_thickness=source.projected_thickness,
    )
    energy = torch.zeros_like(path)
    for frequency, squared in ((tones.frequency, tones.pressure_squared), (broadband.frequency, broadband.bands)):
        heard = frequency * doppler[..., None]
        share = a_weighting_factor(heard) * transmitted_share(absorption(heard), path[..., None])
        energy = energy + (share * squared).sum(-1)
    # Sound of all rotors emitted together arrives together but for their distance from each other.
    arrival = time + path.mean(-1) / loading.speed_of_sound.mean()
    total = energy.sum(-1)
    exposure = torch.trapezoid(total, arrival, dim=-1)
    level = sound_pressure_level(total)
    return level.amax(-1), sound_pressure_level(exposure), level
