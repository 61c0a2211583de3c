"""Bounds of the design variables, each with its reason."""

import math
from dataclasses import dataclass
from typing import Annotated

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


@dataclass(frozen=True)
class _Ends:
    """Checks a bound whose ends lie between `lower` and `upper` in the file's unit; they are kept in SI: times `unit`."""

    lower: float
    upper: float
    unit: float = 1.0

    def __call__(self, bound: Bound) -> Bound:
        for end in ("lower", "upper"):
            if not self.lower <= getattr(bound, end) <= self.upper:
                value = getattr(bound, end)
                raise ValueError(f"{end} = {value:g} is invalid: it must lie between {self.lower:g} and {self.upper:g}")
        return Bound(lower=self.unit * bound.lower, upper=self.unit * bound.upper, reason=bound.reason)


def _ends(lower: float, upper: float, unit: float = 1.0) -> AfterValidator:
    return AfterValidator(_Ends(lower, upper, unit))


DEGREE, RPM = math.pi / 180.0, math.pi / 30.0


class Bounds(Table):
    """What an optimization may choose, in SI units; the file's values must lie within."""

    lift_rotor_radius: Annotated[Bound, _ends(0.2, 10.0)] = Field(alias="lift_rotor_radius_m")
    pusher_radius: Annotated[Bound, _ends(0.2, 10.0)] = Field(alias="pusher_radius_m")
    blade_twist: Annotated[Bound, _ends(-10.0, 90.0, DEGREE)] = Field(alias="blade_twist_deg")
    blade_chord: Annotated[Bound, _ends(0.005, 2.0)] = Field(alias="blade_chord_m")
    lift_motor_length: Annotated[Bound, _ends(0.01, 0.5)] = Field(alias="lift_motor_length_m")
    lift_motor_diameter: Annotated[Bound, _ends(0.05, 1.0)] = Field(alias="lift_motor_diameter_m")
    pusher_motor_length: Annotated[Bound, _ends(0.01, 0.5)] = Field(alias="pusher_motor_length_m")
    pusher_motor_diameter: Annotated[Bound, _ends(0.05, 1.0)] = Field(alias="pusher_motor_diameter_m")
    wing_area: Annotated[Bound, _ends(0.5, 100.0)] = Field(alias="wing_area_m2")
    wing_aspect_ratio: Annotated[Bound, _ends(1.0, 30.0)] = Field(alias="wing_aspect_ratio")
    wing_twist: Annotated[Bound, _ends(-30.0, 30.0, DEGREE)] = Field(alias="wing_twist_deg")
    tail_area: Annotated[Bound, _ends(0.1, 100.0)] = Field(alias="tail_area_m2")
    tail_aspect_ratio: Annotated[Bound, _ends(0.5, 30.0)] = Field(alias="tail_aspect_ratio")
    tail_position: Annotated[Bound, _ends(-50.0, 50.0)] = Field(alias="tail_position_m")
    battery_mass: Annotated[Bound, _ends(10.0, 10000.0)] = Field(alias="battery_mass_kg")
    battery_position: Annotated[Bound, _ends(-50.0, 50.0)] = Field(alias="battery_position_m")
    lift_rotor_speed: Annotated[Bound, _ends(50.0, 10000.0, RPM)] = Field(alias="lift_rotor_speed_rpm")
    pusher_speed: Annotated[Bound, _ends(50.0, 10000.0, RPM)] = Field(alias="pusher_speed_rpm")
    pitch: Annotated[Bound, _ends(-30.0, 30.0, DEGREE)] = Field(alias="pitch_deg")
    tail_deflection: Annotated[Bound, _ends(-40.0, 40.0, DEGREE)] = Field(alias="tail_deflection_deg")


def range_of(name: str) -> tuple[float, float]:
    """Between which the ends of a bound lie, in SI units; `name` is that of a field of `Bounds`."""
    ends: _Ends = next(item.func for item in Bounds.model_fields[name].metadata if isinstance(item, AfterValidator))  # type: ignore[assignment]
    return ends.unit * ends.lower, ends.unit * ends.upper
