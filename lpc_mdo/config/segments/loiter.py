"""Level flight for a time."""

from typing import Literal

from lpc_mdo.config.segments.base import Wingborne
from lpc_mdo.config.tables import key


class Loiter(Wingborne):
    kind: Literal["loiter"]
    is_altitude_free = True
    speed: float = key("speed_m_per_s", 20.0, 120.0)
    altitude: float = key("altitude_m", 100.0, 8000.0)
    duration: float = key("duration_s", 1.0, 36000.0)

    @property
    def flight_speed(self) -> float:
        return self.speed

    @property
    def level_altitude(self) -> float:
        return self.altitude

    @property
    def given_duration(self) -> float:
        return self.duration
