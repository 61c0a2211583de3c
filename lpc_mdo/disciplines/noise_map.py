"""Where a hover is heard how loud: directivity over the sphere and contours on the ground.

Tones and octave bands are A-weighted and absorbed at their own frequencies; rotors add incoherently; the ground's
reflection (up to 6 dB) is left out. Axes x aft, y starboard, z up, thrust along z.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.absorption import transmitted_share
from lpc_mdo.disciplines.hover_noise import BroadbandModel, TonalModel, hover_noise
from lpc_mdo.disciplines.sound import a_weighting_factor, sound_pressure_level
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi

OBSERVERS_AT_ONCE = 256  # bounds the memory of large grids, and
OBSERVERS_OF_STRIPS = 8  # of those whose noise is summed strip by strip

Absorption = Callable[[Tensor], Tensor]  # frequency (...,) Hz to dB/m (...,)


@dataclass(frozen=True)
class HoverSource:
    """Rotors in hover, as `hover_noise` takes them; leading dimensions batch designs."""

    loading: BladeLoading
    thrust: Tensor  # (..., rotor) N
    radius: Tensor  # (..., rotor) m
    angle_of_attack: Tensor  # (..., rotor, station) rad
    hubs: Tensor  # (..., rotor, 3) m


def heard_levels(
    source: HoverSource,
    observers: Tensor,
    tonal_model: TonalModel = barry_magliozzi,
    absorption: Absorption = torch.zeros_like,
    broadband_model: BroadbandModel = "schlegel_king_mull",
) -> Tensor:
    """A-weighted levels (observer dimensions, source's leading dimensions) dB(A) at observers (..., 3) m.

    absorption: dB/m of a frequency, `lambda f: atmospheric_absorption(f, temperature, pressure, humidity)` or none.
    """
    batch = source.hubs.shape[:-2]
    places = observers.reshape(-1, *[1] * len(batch), 3)
    at_once = OBSERVERS_OF_STRIPS if broadband_model == "brooks_pope_marcolini" else OBSERVERS_AT_ONCE
    levels = [_levels(source, some, tonal_model, absorption, broadband_model) for some in places.split(at_once)]
    return torch.cat(levels).reshape(*observers.shape[:-1], *batch)


def _levels(
    source: HoverSource,
    observers: Tensor,
    tonal_model: TonalModel,
    absorption: Absorption,
    broadband_model: BroadbandModel,
) -> Tensor:
    noise = hover_noise(
        source.loading,
        source.thrust,
        source.radius,
        source.angle_of_attack,
        source.hubs,
        observers,
        tonal_model=tonal_model,
        broadband_model=broadband_model,
    )
    path = torch.linalg.vector_norm(observers[..., None, :] - source.hubs, dim=-1)[..., None]
    energy = torch.zeros_like(path[..., 0])
    for frequency, pressure_squared in (
        (noise.tonal.frequency, noise.tonal.pressure_squared),
        (noise.broadband.frequency, noise.broadband.bands),
    ):
        share = a_weighting_factor(frequency) * transmitted_share(absorption(frequency), path)
        energy = energy + (share * pressure_squared).sum(-1)
    return sound_pressure_level(energy.sum(-1))


def sphere_points(center: Tensor, distance: float, polar: Tensor, azimuth: Tensor) -> Tensor:
    """Points (polar, azimuth, 3) m around `center` (3,) m; polar rad from straight up, azimuth rad from ahead to starboard."""
    polar, azimuth = torch.meshgrid(polar, azimuth, indexing="ij")
    across = torch.sin(polar)
    offset = torch.stack([-across * torch.cos(azimuth), across * torch.sin(azimuth), torch.cos(polar)], dim=-1)
    return center + distance * offset


def ground_points(center: Tensor, height: float, aft: Tensor, starboard: Tensor) -> Tensor:
    """Points (aft, starboard, 3) m of the plane `height` m below `center` (3,) m; aft and starboard m from below it."""
    x, y = torch.meshgrid(aft, starboard, indexing="ij")
    return center + torch.stack([x, y, torch.full_like(x, -height)], dim=-1)


def hover_directivity(
    source: HoverSource,
    distance: float,
    polar: Tensor,
    azimuth: Tensor,
    tonal_model: TonalModel = barry_magliozzi,
    absorption: Absorption = torch.zeros_like,
    broadband_model: BroadbandModel = "schlegel_king_mull",
) -> Tensor:
    """Levels (polar, azimuth) dB(A) of one design on the sphere of `distance` m around the middle of its hubs."""
    points = sphere_points(source.hubs.mean(-2), distance, polar, azimuth)
    return heard_levels(source, points, tonal_model, absorption, broadband_model)


def ground_contour(
    source: HoverSource,
    height: float,
    aft: Tensor,
    starboard: Tensor,
    tonal_model: TonalModel = barry_magliozzi,
    absorption: Absorption = torch.zeros_like,
    broadband_model: BroadbandModel = "schlegel_king_mull",
) -> Tensor:
    """Levels (aft, starboard) dB(A) of one design on the ground `height` m below the middle of its hubs."""
    points = ground_points(source.hubs.mean(-2), height, aft, starboard)
    return heard_levels(source, points, tonal_model, absorption, broadband_model)
