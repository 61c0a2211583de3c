"""What is heard of an aircraft's rotors, by the models that its mission names: one way for every problem and figure."""

from collections.abc import Sequence
from typing import Any

from torch import Tensor

from lpc_mdo.config import Requirements
from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.disciplines.hover_noise import TONAL_MODELS, HoverNoise, hover_noise
from lpc_mdo.disciplines.tonal_noise import BladeLoading
from lpc_mdo.model.blade_airfoils import BladePolar, thickness_to_chord

ALL = slice(None)


def blade_loading(loads: RotorLoads, polars: Sequence[BladePolar], rotors: slice = ALL) -> BladeLoading:
    """What the blades of the chosen rotors, of all without a choice, do to the air: (..., rotor, station) and (..., rotor).

    polars: one for each of all rotors.
    """
    return BladeLoading(
        radius=loads.station_radius[..., rotors, :],
        width=loads.station_width[..., rotors, :],
        thrust_per_length=loads.thrust_per_length[..., rotors, :],
        torque_per_length=loads.torque_per_length[..., rotors, :],
        chord=loads.rotor.chord[..., rotors, :],
        thickness_to_chord=thickness_to_chord(polars[rotors]),
        pitch_angle=loads.rotor.twist[..., rotors, :],
        blades=loads.rotor.blades[..., rotors],
        rotation_speed=loads.inflow.rotation_speed[..., rotors],
        density=loads.inflow.density[..., rotors],
        speed_of_sound=loads.inflow.speed_of_sound[..., rotors],
    )


def heard_in_hover(
    loads: RotorLoads,
    polars: Sequence[BladePolar],
    hubs: Tensor,
    observer: Tensor,
    requirements: Requirements,
    rotors: slice = ALL,
    alike: Tensor | None = None,
) -> HoverNoise:
    """Levels of the chosen rotors hovering at hubs (..., rotor, 3) m for an observer (..., 3) m of each design.

    alike (rotor,): how many rotors each stands for, one if not given.
    """
    return hover_noise(
        blade_loading(loads, polars, rotors),
        loads.thrust[..., rotors],
        loads.rotor.radius[..., rotors],
        loads.angle_of_attack[..., rotors, :],
        hubs,
        observer,
        alike=alike,
        **_models(requirements),
    )


def heard_by_observers(
    loads: RotorLoads,
    polars: Sequence[BladePolar],
    hubs: Tensor,
    observers: Tensor,
    requirements: Requirements,
    rotors: slice = ALL,
    alike: Tensor | None = None,
) -> HoverNoise:
    """The same for observers (..., observer, 3) m of each design: levels (..., observer)."""
    return hover_noise(
        blade_loading(loads, polars, rotors).per_observer(),
        loads.thrust[..., None, rotors],
        loads.rotor.radius[..., None, rotors],
        loads.angle_of_attack[..., None, rotors, :],
        hubs[..., None, :, :],
        observers,
        alike=alike,
        **_models(requirements),
    )


def _models(requirements: Requirements) -> dict[str, Any]:
    return {
        "convention": requirements.acoustic_convention,
        "tonal_model": TONAL_MODELS[requirements.tonal_model],
        "broadband_model": requirements.broadband_model,
    }
