"""Climb on the wing from the altitude of the segment before to that of the one after."""

from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from lpc_mdo.config.segments.base import Wingborne
from lpc_mdo.config.tables import between, key


def _speed(value: Any) -> float | str:
    if isinstance(value, str) and value.isidentifier():
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 20.0 <= value <= 120.0:
        raise ValueError(f" = {value!r} is invalid: it must be a number between 20 and 120, or the name of a segment")
    return float(value)


ForwardSpeed = Annotated[float | str, PlainValidator(_speed)]
Altitude = Annotated[float, between(0.0, 8000.0)]


class Climb(Wingborne):
    """speed: m/s, or the name of the segment whose speed it follows; the rate stays. end_altitude: where no level segment follows."""

    kind: Literal["climb"]
    speed: ForwardSpeed = Field(alias="speed_m_per_s")
    rate: float = key("rate_m_per_s", 0.5, 15.0)
    end_altitude: Altitude | None = Field(None, alias="end_altitude_m")

    @property
    def flight_speed(self) -> float | str:
        return self.speed

    @property
    def vertical_rate(self) -> float:
        return self.rate

    @property
    def given_end_altitude(self) -> float | None:
        return self.end_altitude
