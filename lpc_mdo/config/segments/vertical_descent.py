"""Straight down on the lift rotors, at the air of one altitude."""

from typing import Literal

from lpc_mdo.config.segments.base import Hovering
from lpc_mdo.config.tables import key


class VerticalDescent(Hovering):
    """altitude: at which it is evaluated, its middle; height: that it loses. rate: so small that the rotors stay clear of their wake,
    which results flag where they do not."""

    kind: Literal["vertical_descent"]
    rate: float = key("rate_m_per_s", 0.1, 5.0)
    height: float = key("height_m", 1.0, 1000.0)

    @property
    def flight_speed(self) -> float:
        return self.rate

    @property
    def vertical_rate(self) -> float:
        return -self.rate

    @property
    def given_duration(self) -> float:
        return self.height / self.rate
