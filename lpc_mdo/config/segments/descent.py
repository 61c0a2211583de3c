"""Descent on the wing from the altitude of the segment before to that of the one after."""

from typing import Literal

from pydantic import Field

from lpc_mdo.config.segments.base import Wingborne
from lpc_mdo.config.segments.climb import Altitude, ForwardSpeed
from lpc_mdo.config.tables import key


class Descent(Wingborne):
    """speed as of a climb; rate: m/s downwards."""

    kind: Literal["descent"]
    speed: ForwardSpeed = Field(alias="speed_m_per_s")
    rate: float = key("rate_m_per_s", 0.5, 15.0)
    end_altitude: Altitude | None = Field(None, alias="end_altitude_m")

    @property
    def flight_speed(self) -> float | str:
        return self.speed

    @property
    def vertical_rate(self) -> float:
        return -self.rate

    @property
    def given_end_altitude(self) -> float | None:
        return self.end_altitude
