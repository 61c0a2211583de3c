"""Blade-element momentum theory run on published rotor and propeller experiments, with their own section data."""

import math
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum, station_radii
from lpc_mdo.disciplines.blade_sections import Polar
from lpc_mdo.numerics.smooth import smooth_step
from lpc_mdo.surrogates.section_theory import stalled_plate
from lpc_mdo.verification.comparison import reference

STATIONS = 60
RPM = math.pi / 30.0
SPEED_OF_SOUND = 340.0  # m/s; the section data of both experiments are incompressible
BLEND_DEG = (-15.0, -5.0, 12.0, 25.0)  # where a stalled plate takes over from the table, ASSUMED


@dataclass(frozen=True)
class HoverCurve:
    """One rotor over blade angle: measured points; helicopter coefficients."""

    blades: int
    blade_angle_deg: Tensor
    measured_thrust: Tensor
    measured_torque: Tensor

    def model(self, blade_angle_deg: Tensor) -> tuple[Tensor, Tensor]:
        """Thrust and torque coefficient (angle,) at blade angles (angle,) deg."""
        inputs = reference("rotor_knight_hefner_1937")["inputs"]
        section = inputs["section"]

        def polar(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
            cd = section["drag_at_zero_lift"] + section["drag_per_rad2"] * alpha**2
            return section["lift_slope_per_rad"] * alpha, cd

        radius, hub = _tensor(inputs["radius_m"]), _tensor(inputs["root_radius_m"])
        ones = torch.ones(len(blade_angle_deg), STATIONS, dtype=torch.float64)
        twist = torch.deg2rad(blade_angle_deg)[:, None] * ones
        rotor = Rotor(radius, hub, inputs["chord_m"] * ones, twist, _tensor(float(self.blades)))
        speed = torch.full_like(blade_angle_deg, inputs["rpm"] * RPM)
        loads = blade_element_momentum(rotor, _still_air(speed, 1.2, 1.5e-5), polar)
        force = 1.2 * (speed * radius) ** 2 * loads.disk_area
        return loads.thrust / force, loads.torque / (force * radius)


@dataclass(frozen=True)
class PropellerCurve:
    """A propeller over advance ratio; propeller coefficients."""

    advance_ratio: Tensor
    measured_thrust: Tensor
    measured_power: Tensor
    thrust: Tensor
    power: Tensor

    @property
    def measured_efficiency(self) -> Tensor:
        return self.advance_ratio * self.measured_thrust / self.measured_power

    @property
    def efficiency(self) -> Tensor:
        return self.advance_ratio * self.thrust / self.power


def hover_curves() -> list[HoverCurve]:
    """Knight and Hefner (1937): two to five blades. The report refers to half rho: halved to helicopter practice."""
    return [
        HoverCurve(
            blades=row["blades"],
            blade_angle_deg=_tensor(row["blade_angle_deg"]),
            measured_thrust=0.5 * _tensor(row["thrust_coefficient"]),
            measured_torque=0.5 * _tensor(row["torque_coefficient"]),
        )
        for row in reference("rotor_knight_hefner_1937")["results"]
    ]


@dataclass(frozen=True)
class HoverRun:
    """One run of Castles and Gray (1951) over blade angle: helicopter coefficients, torque above that of no thrust."""

    name: str
    blade_angle_deg: Tensor
    measured_thrust: Tensor
    measured_torque: Tensor
    rpm: float
    lift_slope: float  # 1/rad

    def model(self, blade_angle_deg: Tensor) -> tuple[Tensor, Tensor]:
        """Thrust and torque coefficient (angle,) at blade angles (angle,) deg."""
        inputs = reference("rotor_castles_gray_1951")["inputs"]
        section, solidity, blades = inputs["section"], inputs["solidity"], float(inputs["blades"])

        def polar(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
            return self.lift_slope * alpha, section["drag_at_zero_lift"] + section["drag_per_rad2"] * alpha**2

        radius, hub = _tensor(inputs["radius_m"]), _tensor(inputs["root_radius_m"])
        ones = torch.ones(len(blade_angle_deg), STATIONS, dtype=torch.float64)
        chord, twist = solidity * math.pi * radius / blades * ones, torch.deg2rad(blade_angle_deg)[:, None] * ones
        speed = torch.full_like(blade_angle_deg, self.rpm * RPM)
        loads = blade_element_momentum(
            Rotor(radius, hub, chord, twist, _tensor(blades)), _still_air(speed, 1.2, 1.6e-5), polar
        )
        force = 1.2 * (speed * radius) ** 2 * loads.disk_area
        idle = solidity * section["drag_at_zero_lift"] / 8.0 * (1.0 - (hub / radius) ** 4)
        return loads.thrust / force, loads.torque / (force * radius) - idle


def castles_gray_runs() -> list[HoverRun]:
    """Three blades of NACA 0015, four runs at two speeds."""
    return [
        HoverRun(
            name=f"run {row['run']}, {row['rpm']:.0f} rpm",
            blade_angle_deg=_tensor(row["blade_angle_deg"]),
            measured_thrust=_tensor(row["thrust_coefficient"]),
            measured_torque=_tensor(row["torque_coefficient"]),
            rpm=row["rpm"],
            lift_slope=row["lift_slope_per_rad"],
        )
        for row in reference("rotor_castles_gray_1951")["results"]
    ]


def caradonna_tung_thrust(blade_angle_deg: Tensor | None = None) -> Tensor:
    """Thrust coefficient (angle,) of the rotor of Caradonna and Tung (1981); at the measured angles if none are given."""
    data = reference("rotor_caradonna_tung_1981")
    inputs, rows = data["inputs"], data["results"]
    section = inputs["section"]
    angles = _tensor([row["blade_angle_deg"] for row in rows]) if blade_angle_deg is None else blade_angle_deg

    def polar(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        return section["lift_slope_per_rad"] * alpha, torch.full_like(alpha, section["drag"])

    radius, hub = _tensor(inputs["radius_m"]), _tensor(inputs["root_radius_m"])
    ones = torch.ones(len(angles), STATIONS, dtype=torch.float64)
    twist = torch.deg2rad(angles)[:, None] * ones
    rotor = Rotor(radius, hub, inputs["chord_m"] * ones, twist, _tensor(float(inputs["blades"])))
    speed = torch.full_like(angles, inputs["rpm"] * RPM)
    loads = blade_element_momentum(rotor, _still_air(speed, 1.2, 1.5e-5), polar)
    return loads.thrust / (1.2 * (speed * radius) ** 2 * loads.disk_area)


def propeller_curve() -> PropellerCurve:
    """Deters, Ananda and Selig (2014): DA4002 9x6.75 near 5000 rpm, from standstill to zero thrust."""
    data = reference("propeller_da4002_2014")
    rows = data["results"]
    rpm = torch.cat([torch.full((len(row["advance_ratio"]),), row["rpm"], dtype=torch.float64) for row in rows])
    advance, thrust, power = (
        torch.cat([_tensor(row[key]) for row in rows])
        for key in ("advance_ratio", "thrust_coefficient", "power_coefficient")
    )
    loads = da4002_loads(rpm * RPM, advance)
    order = torch.argsort(advance, stable=True)
    return PropellerCurve(
        advance_ratio=advance[order],
        measured_thrust=thrust[order],
        measured_power=power[order],
        thrust=loads.thrust_coefficient[order],
        power=2.0 * math.pi * loads.torque_coefficient[order],
    )


def da4002_loads(rotation_speed: Tensor, advance_ratio: Tensor) -> RotorLoads:
    """The propeller DA4002 9x6.75 at rotation_speed (...,) rad/s and advance_ratio (...,)."""
    inputs = reference("propeller_da4002_2014")["inputs"]
    radius = _tensor(0.5 * inputs["diameter_m"])
    hub = inputs["station_over_radius"][0] * radius
    r, _ = station_radii(radius, hub, STATIONS)
    share = r / radius
    at = _tensor(inputs["station_over_radius"])
    rotor = Rotor(
        radius,
        hub,
        interpolate(share, at, _tensor(inputs["chord_over_radius"])) * radius,
        torch.deg2rad(interpolate(share, at, _tensor(inputs["blade_angle_deg"]))),
        _tensor(float(inputs["blades"])),
    )
    axial = advance_ratio * rotation_speed * radius / math.pi
    inflow = _still_air(rotation_speed, inputs["density_kg_per_m3"], inputs["kinematic_viscosity_m2_per_s"])
    inflow = Inflow(axial, rotation_speed, inflow.density, inflow.speed_of_sound, inflow.dynamic_viscosity)
    return blade_element_momentum(rotor, inflow, tabulated_polar(inputs["polar"]), has_hub_loss=True)


def interpolate(x: Tensor, at: Tensor, values: Tensor) -> Tensor:
    """Piecewise linear: values (n,) at increasing `at` (n,), held beyond the ends."""
    x = x.clamp(at[0], at[-1])
    index = torch.searchsorted(at, x.detach().contiguous()).clamp(1, len(at) - 1)
    share = (x - at[index - 1]) / (at[index] - at[index - 1])
    return values[index - 1] + share * (values[index] - values[index - 1])


def tabulated_polar(table: dict[str, Any]) -> Polar:
    """Bilinear in angle of attack and Reynolds number, both held at the ends; a stalled plate beyond the angles."""
    angles, sizes = torch.deg2rad(_tensor(table["alpha_deg"])), _tensor(table["reynolds"])
    columns = [_tensor(table[key]) for key in ("cl", "cd")]  # (reynolds, angle)
    low_full, low_none, high_none, high_full = (math.radians(angle) for angle in BLEND_DEG)

    def polar(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        size = reynolds.clamp(sizes[0], sizes[-1])
        i = torch.searchsorted(sizes, size.detach().contiguous()).clamp(1, len(sizes) - 1)
        share = (size - sizes[i - 1]) / (sizes[i] - sizes[i - 1])
        angle = alpha.clamp(angles[0], angles[-1])
        j = torch.searchsorted(angles, angle.detach().contiguous()).clamp(1, len(angles) - 1)
        part = (angle - angles[j - 1]) / (angles[j] - angles[j - 1])
        stalled = smooth_step((alpha - high_none) / (high_full - high_none)) + smooth_step(
            (alpha - low_none) / (low_full - low_none)
        )
        result = []
        for values, plate in zip(columns, stalled_plate(torch.sin(alpha), torch.cos(alpha)), strict=True):
            below = values[i - 1, j - 1] + part * (values[i - 1, j] - values[i - 1, j - 1])
            above = values[i, j - 1] + part * (values[i, j] - values[i, j - 1])
            inside = below + share * (above - below)
            result.append(inside + stalled * (plate - inside))
        return result[0], result[1]

    return polar


def _still_air(rotation_speed: Tensor, density: float, kinematic_viscosity: float) -> Inflow:
    like = torch.ones_like(rotation_speed)
    return Inflow(
        0.0 * like, rotation_speed, density * like, SPEED_OF_SOUND * like, density * kinematic_viscosity * like
    )


def _tensor(values: object) -> Tensor:
    return torch.as_tensor(values, dtype=torch.float64)
