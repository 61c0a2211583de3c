"""Level flight over a distance."""

from typing import Literal

from lpc_mdo.config.segments.base import Level
from lpc_mdo.config.tables import key


class Cruise(Level):
    """distance: over the ground, that of the climbs and descents that lead to it and from it included."""

    kind: Literal["cruise"]
    distance: float = key("distance_m", 1000.0, 1e6)

    @property
    def given_distance(self) -> float:
        return self.distance
