"""Cases of a rotor's tones and of A-weighting."""

import math
from typing import Annotated, Any

import torch
from pydantic import Field, model_validator

from lpc_mdo.cases.files import RPM, Angle, Strict, positive, within
from lpc_mdo.disciplines import sound
from lpc_mdo.disciplines.blade_element import station_radii
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi
from lpc_mdo.numerics.tensors import tensor


class ToneInputs(Strict):
    blades: Annotated[int, within(1, 12)]
    radius_m: Annotated[float, positive(100.0)]
    root_radius_m: Annotated[float, positive(100.0)]
    rpm: Annotated[float, positive(1e7)]
    thrust_N: Annotated[float, within(-1e7, 1e7)]
    torque_N_m: Annotated[float, within(-1e7, 1e7)]
    chord_m: Annotated[float, positive(100.0)]
    thickness_to_chord: Annotated[float, within(0.01, 1.0)]
    speed_of_sound_m_per_s: Annotated[float, positive(1e4)]
    rho: Annotated[float, positive(2000.0)]
    distance_m: Annotated[float, positive(1e6)]
    loading: str = ""

    @model_validator(mode="after")
    def _is_subsonic_and_seen_from_outside(self) -> "ToneInputs":
        if self.root_radius_m >= self.radius_m:
            raise ValueError(
                f"root_radius_m = {self.root_radius_m} is not allowed; it must be below radius_m = {self.radius_m}"
            )
        if self.chord_m > self.radius_m:
            raise ValueError(f"chord_m = {self.chord_m} is invalid: it must be at most radius_m = {self.radius_m}")
        if self.distance_m <= self.radius_m:
            raise ValueError(
                f"distance_m = {self.distance_m} is not allowed; it must exceed radius_m = {self.radius_m}"
            )
        if (mach := self.rpm * RPM * self.radius_m / self.speed_of_sound_m_per_s) >= 1.0:
            raise ValueError(
                f"rpm = {self.rpm:g} is invalid: the tip turns at Mach {mach:.4g}, and the theory holds below Mach 1"
            )
        return self


class ToneCondition(Strict):
    elevation_from_disk_plane_deg: Angle


class WeightingInputs(Strict):
    frequency_Hz: list[Annotated[float, positive(1e7)]] = Field(min_length=1, max_length=100_000)


def analyze_tones(inputs: ToneInputs, conditions: list[ToneCondition], mesh: Any) -> list[dict[str, Any]]:
    """Loads proportional to r^2, local pitch 0.1 rad, 400 stations: what the reference case prescribes."""
    r, width = station_radii(tensor(inputs.radius_m), tensor(inputs.root_radius_m), 400)
    shape = r**2 / ((r**2).sum() * width)
    loading = BladeLoading(
        radius=r,
        width=width,
        thrust_per_length=inputs.thrust_N * shape,
        torque_per_length=inputs.torque_N_m * shape,
        chord=torch.full_like(r, inputs.chord_m),
        thickness_to_chord=inputs.thickness_to_chord,
        pitch_angle=torch.full_like(r, 0.1),
        blades=tensor(float(inputs.blades)),
        rotation_speed=tensor(inputs.rpm * RPM),
        density=tensor(inputs.rho),
        speed_of_sound=tensor(inputs.speed_of_sound_m_per_s),
    )
    results = []
    for condition in conditions:
        height = inputs.distance_m * math.sin(math.radians(condition.elevation_from_disk_plane_deg))
        noise = barry_magliozzi(loading, tensor(-height), tensor(inputs.distance_m), harmonics=6)
        weighted = noise.pressure_squared * sound.a_weighting_factor(noise.frequency)
        columns = (noise.frequency, noise.loading.sqrt(), noise.thickness.sqrt())
        keys = ("frequency_Hz", "p_loading_rms_Pa", "p_thickness_rms_Pa")
        results.append(
            {
                **condition.model_dump(),
                "harmonics": [
                    {"harmonic": m + 1, **{key: float(column[m]) for key, column in zip(keys, columns, strict=True)}}
                    for m in range(6)
                ],
                "spl_db": float(sound.sound_pressure_level(noise.pressure_squared.sum())),
                "spl_dba_per_harmonic": float(sound.sound_pressure_level(weighted.sum())),
            }
        )
    return results


def analyze_weighting(inputs: WeightingInputs, conditions: list[Any], mesh: Any) -> list[float]:
    return sound.a_weighting(tensor(inputs.frequency_Hz)).tolist()
