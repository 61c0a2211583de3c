"""Airfoil self-noise against the tables of its own report, and of a rotor against another program's."""

import math
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.disciplines.airfoil_self_noise import (
    Listener,
    Section,
    laminar_vortex_noise,
    tip_vortex_noise,
    trailing_edge_noise,
)
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.rotor_self_noise import blade_strips, heard_over_a_turn
from lpc_mdo.disciplines.sound import REFERENCE_PRESSURE, third_octave_centers
from lpc_mdo.disciplines.tonal_noise import BladeLoading
from lpc_mdo.verification.comparison import Between, Comparison, reference

LOWEST = -60.0  # dB: below it the report's program cuts off
STATIONS = 50


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        return [
            *(row for name in reference("noise_airfoil_self_noise_1989")["results"] for row in _tables(name)),
            *_rotor(),
        ]


def _tables(name: str) -> list[Comparison]:
    case = reference("noise_airfoil_self_noise_1989")
    air, table = case["inputs"], case["results"][name]
    strip, frequency = table["inputs"], _tensor(table["frequency_Hz"])
    listener = Listener(_tensor(air["distance_m"]), _tensor(0.0), _tensor(1.0))

    def section(degrees: float) -> Section:
        values = (air["speed_m_per_s"], strip["chord_m"], strip["span_m"], math.radians(degrees))
        return Section(
            *(_tensor(v) for v in (*values, air["speed_of_sound_m_per_s"], air["kinematic_viscosity_m2_per_s"]))
        )

    inner = section(strip["angle_of_attack_deg"])
    edge = trailing_edge_noise(inner, listener, frequency, strip["boundary_layer"])
    parts = {"pressure_side": edge.pressure_side, "suction_side": edge.suction_side, "separation": edge.separation}
    if "laminar_vortex_db" in table:
        parts["laminar_vortex"] = laminar_vortex_noise(inner, listener, frequency)
    if "tip_vortex_db" in table:
        parts["tip_vortex"] = tip_vortex_noise(section(strip["tip_angle_of_attack_deg"]), listener, frequency)
    parts["total"] = torch.stack(list(parts.values())).sum(0)
    between, rows = Between("Brooks-Pope-Marcolini", "program of its report, NASA RP-1218, tables D2 and D3"), []
    for part, squared in parts.items():
        theirs = _tensor(table[f"{part}_db"])
        is_heard = theirs > LOWEST
        reason = "digits of the fits' constants" if part != "tip_vortex" else "the tip's angle is printed to two digits"
        rows.append(
            between.absolute(
                f"{part.replace('_', ' ')} of the {name}, third-octaves, dB", _levels(squared)[is_heard], theirs[is_heard],
                0.5, reason, "dB",
            )
        )  # fmt: skip
    return rows


def _rotor() -> list[Comparison]:
    case = reference("noise_ideally_twisted_rotor_parts")
    inputs = case["inputs"]
    loading, angle = _ideally_twisted(inputs)
    below = math.radians(inputs["observer_below_disk_deg"])
    arm = inputs["observer_distance_m"] * _tensor([math.cos(below), 0.0, -math.sin(below)])
    centers = third_octave_centers()
    narrow = inputs["bandwidth_Hz"] / (centers * (10.0**0.05 - 10.0**-0.05))
    between = Between(
        "Brooks-Pope-Marcolini on a rotor", "PAS, ROTONET and BARC (NASA), Pettingill et al. (2021), figure 22b"
    )
    rows = []
    for part, curve in case["results"].items():
        bands = heard_over_a_turn(
            loading, blade_strips(loading, angle), arm, centers,
            lambda *at, part=part: getattr(trailing_edge_noise(*at, "tripped"), part),
        )  # fmt: skip
        rows.append(
            between.absolute(
                f"{part.replace('_', ' ')} of the ideally twisted rotor, highest level in 20 Hz, dB",
                _levels(bands * narrow).max(), max(curve["level_db"]), 3.0,
                "their inflow and angles of attack are their own; their convective amplification is of fourth power", "dB",
            )
        )  # fmt: skip
    return rows


def _ideally_twisted(inputs: dict[str, Any]) -> tuple[BladeLoading, Tensor]:
    """The rotor's loading by blade-element momentum theory, and its angles of attack (station,) rad; symmetric section."""
    section = inputs["section"]

    def polar(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        return section["lift_slope_per_rad"] * alpha, torch.full_like(alpha, section["drag"])

    radius, hub, blades = (_tensor(inputs[key]) for key in ("radius_m", "root_radius_m", "blades"))
    r, width = station_radii(radius, hub, STATIONS)
    twist, chord = math.radians(inputs["tip_angle_deg"]) * radius / r, torch.full_like(r, inputs["chord_m"])
    speed, density, sound = (
        _tensor(inputs["rpm"] * math.pi / 30.0),
        *(_tensor(inputs[key]) for key in ("density_kg_per_m3", "speed_of_sound_m_per_s")),
    )
    inflow = Inflow(_tensor(0.0), speed, density, sound, _tensor(1.79e-5))
    loads = blade_element_momentum(Rotor(radius, hub, chord, twist, blades), inflow, polar)
    loading = BladeLoading(
        r, width, loads.thrust_per_length, loads.torque_per_length, chord, 0.12, twist, blades, speed, density, sound
    )
    return loading, loads.angle_of_attack


def _levels(squared: Tensor) -> Tensor:
    return 10.0 * torch.log10(squared / REFERENCE_PRESSURE**2)


def _tensor(value: object) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)
