"""Level flight over a distance."""

from typing import Literal

from lpc_mdo.config.segments.base import Wingborne
from lpc_mdo.config.tables import key


class Cruise(Wingborne):
    """distance: over the ground, that of the climbs and descents that lead to it and from it included."""

    kind: Literal["cruise"]
    is_altitude_free = True
    speed: float = key("speed_m_per_s", 20.0, 120.0)
    altitude: float = key("altitude_m", 100.0, 8000.0)
    distance: float = key("distance_m", 1000.0, 1e6)

    @property
    def flight_speed(self) -> float:
        return self.speed

    @property
    def level_altitude(self) -> float:
        return self.altitude

    @property
    def given_distance(self) -> float:
        return self.distance
