"""What an observer hears of several hovering rotors: tones and broadband, A-weighted, energies added."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import torch
from torch import Tensor

from lpc_mdo.disciplines.broadband_noise import (
    CODE_REFERENCE_DISTANCE,
    REFERENCE_DISTANCE,
    BroadbandNoise,
    gill_lee,
    schlegel_king_mull,
)
from lpc_mdo.disciplines.rotor_self_noise import rotor_self_noise
from lpc_mdo.disciplines.sound import (
    REFERENCE_PRESSURE,
    a_weighting_factor,
    bands_in_third_octaves,
    sound_pressure_level,
    tones_in_third_octaves,
)
from lpc_mdo.disciplines.tonal_noise import BladeLoading, TonalNoise, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import lowson_noise

Convention = Literal["per_band", "lsdo_acoustics_2023", "acoustics_2022"]
BroadbandModel = Literal["schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"]
TonalModel = Callable[[BladeLoading, Tensor, Tensor, int], TonalNoise]  # loading, axial distance, distance, harmonics
TONAL_MODELS: dict[str, TonalModel] = {"steady_loading": barry_magliozzi, "unsteady_loading": lowson_noise}
HARMONICS: dict[Convention, int] = {"per_band": 10, "lsdo_acoustics_2023": 3, "acoustics_2022": 3}


@dataclass(frozen=True)
class HoverNoise:
    """Levels at the observer, (...,), of all rotors, and the spectra of each (..., rotor, ...)."""

    total_dba: Tensor
    tonal_dba: Tensor
    broadband_dba: Tensor
    total_db: Tensor
    rotor_dba: Tensor  # (..., rotor)
    tonal: TonalNoise
    broadband: BroadbandNoise


def observer_position(center: Tensor, distance: float, elevation: float) -> Tensor:
    """Point (..., 3) m at `distance` m from `center` (..., 3), below and ahead, `elevation` rad from the disk plane."""
    offset = [-distance * math.cos(elevation), 0.0, -distance * math.sin(elevation)]
    return center + torch.tensor(offset, dtype=center.dtype, device=center.device)


def hover_noise(
    loading: BladeLoading,
    thrust: Tensor,
    radius: Tensor,
    angle_of_attack: Tensor,
    hubs: Tensor,
    observer: Tensor,
    convention: Convention = "per_band",
    tonal_model: TonalModel = barry_magliozzi,
    broadband_model: BroadbandModel = "schlegel_king_mull",
    alike: Tensor | None = None,
) -> HoverNoise:
    """Levels of rotors hovering at hubs (..., rotor, 3) m for an observer (..., 3) m; thrust upward, along z.

    thrust (..., rotor) N; radius (..., rotor) m; angle_of_attack (..., rotor, station) rad. Several observers make the
    leading dimensions. tonal_model: steady tones by default; `lowson_noise` has those near the axis too. broadband_model:
    `schlegel_king_mull` in octaves about a peak, `gill_lee` or, strip by strip, `rotor_self_noise` in third-octaves. Raises
    ValueError for other names. alike (rotor,): how many rotors, heard alike, each of those given stands for; one if left out.

    convention "per_band" weights each tone and each octave band at its own frequency, with the broadband reference
    distance of 150 ft. The others follow codes of the published study's authors, for comparison, both with three tones and a
    reference distance of 150 m. "lsdo_acoustics_2023", LSDOlab/lsdo_acoustics of July 2023, after the paper,
    weights tonal sum and overall broadband level both at the blade-passing frequency. "acoustics_2022", MariusLRuh/acoustics
    from August 2022 on, adds 10^(A/10) to the energy of each tone and band where it ought to multiply, so that levels are in
    effect unweighted; its tones are those of an observer above the disk, and its broadband directivity takes the distance
    fore and aft for the height, so that this part nearly vanishes below. Rotors add incoherently; the ground's reflection
    (up to 6 dB) is left out. Raises ValueError for other conventions.
    """
    if convention not in HARMONICS:
        names = ", ".join(repr(name) for name in HARMONICS)
        raise ValueError(f"convention = {convention!r} is invalid: it must be one of {names}")
    arm = observer[..., None, :] - hubs
    distance = torch.linalg.vector_norm(arm, dim=-1)
    is_2022 = convention == "acoustics_2022"
    axial = arm[..., 2].abs() if is_2022 else arm[..., 2]
    tonal = tonal_model(loading, axial, distance, HARMONICS[convention])
    rotor = {
        "thrust": thrust,
        "radius": radius,
        "tip_speed": loading.rotation_speed * radius,
        "blade_area": loading.blades * (loading.chord * loading.width).sum(-1),
        "density": loading.density,
        "elevation_sine": arm[..., 0 if is_2022 else 2].abs() / distance,
        "distance": distance,
    }
    if broadband_model == "schlegel_king_mull":
        broadband = schlegel_king_mull(
            **rotor,
            projected_thickness=_projected_thickness(loading, radius, angle_of_attack),
            reference_distance=REFERENCE_DISTANCE if convention == "per_band" else CODE_REFERENCE_DISTANCE,
        )
    elif broadband_model == "gill_lee":
        broadband = gill_lee(**rotor, blades=loading.blades, speed_of_sound=loading.speed_of_sound)
    elif broadband_model == "brooks_pope_marcolini":
        broadband = rotor_self_noise(loading, angle_of_attack, arm)
    else:
        names = " or ".join(repr(name) for name in get_args(BroadbandModel))
        raise ValueError(f"broadband_model = {broadband_model!r} is not allowed; it must be {names}")
    if convention == "lsdo_acoustics_2023":
        factor = a_weighting_factor(tonal.frequency[..., 0])
        tones = factor * tonal.pressure_squared.sum(-1)
        noise = factor * broadband.overall
    elif is_2022:
        unit = REFERENCE_PRESSURE**2
        tones = (tonal.pressure_squared + unit * a_weighting_factor(tonal.frequency)).sum(-1)
        noise = (broadband.bands + unit * a_weighting_factor(broadband.frequency)).sum(-1)
    else:
        tones = (a_weighting_factor(tonal.frequency) * tonal.pressure_squared).sum(-1)
        noise = (a_weighting_factor(broadband.frequency) * broadband.bands).sum(-1)
    unweighted = tonal.pressure_squared.sum(-1) + broadband.overall
    count = torch.ones_like(thrust) if alike is None else alike
    return HoverNoise(
        total_dba=sound_pressure_level(((tones + noise) * count).sum(-1)),
        tonal_dba=sound_pressure_level((tones * count).sum(-1)),
        broadband_dba=sound_pressure_level((noise * count).sum(-1)),
        total_db=sound_pressure_level((unweighted * count).sum(-1)),
        rotor_dba=sound_pressure_level(tones + noise),
        tonal=tonal,
        broadband=broadband,
    )


def third_octave_spectrum(noise: HoverNoise, centers: Tensor) -> Tensor:
    """Levels (..., band) dB of all rotors together in the third-octaves at `centers` (band,) Hz, unweighted.

    Tones jump from band to band as speeds change: for spectra to look at.
    """
    tones = tones_in_third_octaves(noise.tonal.frequency, noise.tonal.pressure_squared, centers)
    rest = bands_in_third_octaves(noise.broadband.frequency, noise.broadband.bands, centers, noise.broadband.thirds)
    return sound_pressure_level((tones + rest).sum(-2))


def _projected_thickness(loading: BladeLoading, radius: Tensor, angle_of_attack: Tensor) -> Tensor:
    """Blade thickness across the flow (..., rotor) m at the stations next to 0.7 R, linear between them."""
    # Hat functions on the stations: linear interpolation that follows a changing radius smoothly enough.
    distance = (loading.radius - 0.7 * radius[..., None]).abs() / (loading.radius[..., 1:2] - loading.radius[..., 0:1])
    weight = (1.0 - distance).clamp(min=0.0)
    chord = (weight * loading.chord).sum(-1) / weight.sum(-1)
    alpha = (weight * angle_of_attack).sum(-1) / weight.sum(-1)
    thickness = (weight * loading.thickness_to_chord).sum(-1) / weight.sum(-1)
    sine = torch.sqrt(torch.sin(alpha) ** 2 + 1e-6)
    return chord * (thickness * torch.cos(alpha) + sine)
