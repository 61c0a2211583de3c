"""Level flight for a time."""

from typing import Literal

from lpc_mdo.config.segments.base import Level
from lpc_mdo.config.tables import key


class Loiter(Level):
    kind: Literal["loiter"]
    duration: float = key("duration_s", 1.0, 36000.0)

    @property
    def given_duration(self) -> float:
        return self.duration
