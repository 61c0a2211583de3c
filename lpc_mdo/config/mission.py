"""The mission file."""

import math
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from lpc_mdo.config.tables import Table, between, in_degrees, key


def _no_former_convention(value: object) -> object:
    if value == "paper":
        raise ValueError(
            ' = "paper" is invalid: write "lsdo_acoustics_2023", the code after the paper that it stood for'
        )
    return value


CRUISE = "cruise"


def _none_at_cruise_speed(value: object) -> object:
    if isinstance(value, str) and value != CRUISE:
        raise ValueError(f' = {value!r} is invalid: it must be a number or "{CRUISE}"')
    return None if value == CRUISE else value


MOST_OBSERVERS = 91  # one a degree; each takes 4 MB a design


class Hover(Table):
    altitude: float = key("altitude_m", 0.0, 5000.0)
    duration: float = key("duration_s", 1.0, 3600.0)


class Climb(Table):
    """speed: m/s, None where the file says "cruise": then that of the cruise, whatever it is; the rate stays."""

    speed: Annotated[float | None, BeforeValidator(_none_at_cruise_speed)] = key("speed_m_per_s", 20.0, 120.0)
    rate: float = key("rate_m_per_s", 0.5, 15.0)


class Cruise(Table):
    speed: float = key("speed_m_per_s", 20.0, 120.0)
    altitude: float = key("altitude_m", 100.0, 8000.0)
    distance: float = key("distance_m", 1000.0, 1e6)


class Reserve(Table):
    """Flown at cruise power over a distance, m, or for a time, s: one of the two, the other is None."""

    distance: float | None = Field(None, alias="distance_m", ge=0.0, le=1e6, strict=True)
    duration: float | None = Field(None, alias="duration_s", ge=0.0, le=1e5, strict=True)

    @model_validator(mode="after")
    def _is_one_of_both(self) -> "Reserve":
        if (self.distance is None) == (self.duration is None):
            has = "neither" if self.distance is None else "both"
            raise ValueError(f" has {has} of distance_m and duration_s; it must have one of them")
        return self


class Requirements(Table):
    minimum_final_state_of_charge: float = between(0.0, 0.9)
    stall_margin: float = key("stall_margin_m_per_s", 0.0, 40.0)
    rotor_tip_clearance: float = key("rotor_tip_clearance_m", 0.0, 2.0)
    maximum_sound_pressure_level: float = key("maximum_sound_pressure_level_dba", 20.0, 140.0)
    observer_distance: float = key("observer_distance_m", 10.0, 2000.0)
    observer_elevation: in_degrees(0.0, 90.0) = Field(alias="observer_elevation_deg")
    further_observer_elevations: tuple[in_degrees(0.0, 90.0), ...] = Field(
        (), alias="further_observer_elevations_deg", max_length=MOST_OBSERVERS
    )
    acoustic_convention: Annotated[
        Literal["per_band", "lsdo_acoustics_2023", "acoustics_2022"], BeforeValidator(_no_former_convention)
    ]
    tonal_model: Literal["steady_loading", "unsteady_loading"] = "steady_loading"
    broadband_model: Literal["schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"] = "schlegel_king_mull"

    @model_validator(mode="after")
    def _has_few_observers(self) -> "Requirements":
        # All observers are heard in one batch with its derivatives: 5 MB each, 170 MB strip by strip.
        limit = 8 if self.broadband_model == "brooks_pope_marcolini" else 64
        if (count := len(self.further_observer_elevations)) > limit:
            raise ValueError(
                f"further_observer_elevations_deg has {count} values; "
                f"it may have at most {limit} with broadband_model = {self.broadband_model!r}"
            )
        return self


class Mission(Table):
    """Segments and requirements in SI units."""

    flights: int = between(1, 20)
    temperature_offset: float = key("temperature_offset_K", -50.0, 50.0)
    rotor_inflow: Literal["axial", "inclined"] = "axial"
    hover: Hover
    climb: Climb
    cruise: Cruise
    reserve: Reserve
    requirements: Requirements

    @model_validator(mode="after")
    def _is_flyable(self) -> "Mission":
        if self.cruise.altitude <= self.hover.altitude:
            raise ValueError(
                f"cruise.altitude_m = {self.cruise.altitude:g} is not allowed; "
                f"it must exceed hover.altitude_m = {self.hover.altitude:g}"
            )
        if self.cruise.distance <= self.climb_distance:
            raise ValueError(
                f"cruise.distance_m = {self.cruise.distance:g} is not allowed; "
                f"it includes the climb and must exceed its {self.climb_distance:.0f} m"
            )
        return self

    @property
    def climb_speed(self) -> float:
        """m/s, the cruise speed where the climb follows it."""
        return self.cruise.speed if self.climb.speed is None else self.climb.speed

    @property
    def climb_path_angle(self) -> float:
        """rad."""
        return math.asin(self.climb.rate / self.climb_speed)

    @property
    def climb_distance(self) -> float:
        """Ground covered from hover to cruise altitude, m."""
        time = (self.cruise.altitude - self.hover.altitude) / self.climb.rate
        return time * (self.climb_speed**2 - self.climb.rate**2) ** 0.5
