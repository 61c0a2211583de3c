"""Bounds of the design variables, each with its reason."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from lpc_mdo.config.tables import Table


class Bound(Table):
    """Bounds of a design variable and why they stand where they do."""

    lower: float = Field(strict=True)
    upper: float = Field(strict=True)
    reason: str = Field(min_length=1)

    @model_validator(mode="after")
    def _is_a_range(self) -> "Bound":
        if self.lower > self.upper:
            raise ValueError(f"lower = {self.lower:g} is invalid: it must not exceed upper = {self.upper:g}")
        return self


def _bound(name: str, lower: float, upper: float, unit: float = 1.0) -> Any:
    """A bound whose ends lie between `lower` and `upper` in the file's unit and are kept in SI: times `unit`."""

    def checked(bound: Bound) -> Bound:
        for end in ("lower", "upper"):
            if not lower <= getattr(bound, end) <= upper:
                value = getattr(bound, end)
                raise ValueError(f"{end} = {value:g} is invalid: it must lie between {lower:g} and {upper:g}")
        return Bound(lower=unit * bound.lower, upper=unit * bound.upper, reason=bound.reason)

    return Annotated[Bound, AfterValidator(checked), Field(alias=name)]


DEGREE, RPM = math.pi / 180.0, math.pi / 30.0


class Bounds(Table):
    """What an optimization may choose, in SI units; the file's values must lie within."""

    lift_rotor_radius: _bound("lift_rotor_radius_m", 0.2, 10.0)
    pusher_radius: _bound("pusher_radius_m", 0.2, 10.0)
    blade_twist: _bound("blade_twist_deg", -10.0, 90.0, DEGREE)
    blade_chord: _bound("blade_chord_m", 0.005, 2.0)
    lift_motor_length: _bound("lift_motor_length_m", 0.01, 0.5)
    lift_motor_diameter: _bound("lift_motor_diameter_m", 0.05, 1.0)
    pusher_motor_length: _bound("pusher_motor_length_m", 0.01, 0.5)
    pusher_motor_diameter: _bound("pusher_motor_diameter_m", 0.05, 1.0)
    wing_area: _bound("wing_area_m2", 0.5, 100.0)
    wing_aspect_ratio: _bound("wing_aspect_ratio", 1.0, 30.0)
    wing_twist: _bound("wing_twist_deg", -30.0, 30.0, DEGREE)
    tail_area: _bound("tail_area_m2", 0.1, 100.0)
    tail_aspect_ratio: _bound("tail_aspect_ratio", 0.5, 30.0)
    tail_position: _bound("tail_position_m", -50.0, 50.0)
    battery_mass: _bound("battery_mass_kg", 10.0, 10000.0)
    battery_position: _bound("battery_position_m", -50.0, 50.0)
    lift_rotor_speed: _bound("lift_rotor_speed_rpm", 50.0, 10000.0, RPM)
    pusher_speed: _bound("pusher_speed_rpm", 50.0, 10000.0, RPM)
    pitch: _bound("pitch_deg", -30.0, 30.0, DEGREE)
    tail_deflection: _bound("tail_deflection_deg", -40.0, 40.0, DEGREE)
