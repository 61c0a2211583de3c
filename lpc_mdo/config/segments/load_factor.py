"""A load factor on the wing: a pull-up, a push-over, or what a gust does."""

from typing import Literal

from lpc_mdo.config.segments.base import Wingborne
from lpc_mdo.config.tables import key


class LoadFactor(Wingborne):
    """Lift is `factor` times the weight at one speed, rotors stopped; drag is not balanced. It is sized for and never flown.

    Turning of the aircraft, which adds to the tail's angle of attack, is left out.
    """

    kind: Literal["load_factor"]
    altitude: float = key("altitude_m", 0.0, 8000.0)
    speed: float = key("speed_m_per_s", 20.0, 150.0)
    factor: float = key("load_factor", -4.0, 6.0)
    is_always_flown = False
    default_rotors = ()
    imposed = (2, 4)

    @property
    def flight_speed(self) -> float:
        return self.speed

    @property
    def level_altitude(self) -> float:
        return self.altitude

    @property
    def load_factor(self) -> float:
        return self.factor

    @property
    def given_duration(self) -> float:
        return 0.0
