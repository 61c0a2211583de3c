"""Hover at one altitude for a time."""

from typing import Literal

from lpc_mdo.config.segments.base import Hovering
from lpc_mdo.config.tables import key


class Hover(Hovering):
    kind: Literal["hover"]
    duration: float = key("duration_s", 1.0, 3600.0)

    @property
    def flight_speed(self) -> float:
        return 0.0

    @property
    def given_duration(self) -> float:
        return self.duration
