"""Hover with a failed rotor."""

import re
from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from lpc_mdo.config.segments.base import Hovering, Segment
from lpc_mdo.config.tables import key

EACH = "each"


class RotorInoperative(Hovering):
    """rotor: the one that has failed, or "each": every rotor of its groups in turn, of mirrored ones that to port.

    The others hold weight, roll, pitch and yaw; nothing mirrors. It is sized for and never flown.
    """

    kind: Literal["rotor_inoperative"]
    rotor: str = Field(EACH, min_length=1, max_length=80)
    duration: float = key("duration_s", 1.0, 600.0)
    is_always_flown = False
    imposed = (2, 3, 4, 5)

    @property
    def flight_speed(self) -> float:
        return 0.0

    @property
    def given_duration(self) -> float:
        return self.duration

    @property
    def inoperative_rotor(self) -> str:
        return self.rotor

    def points(self, rotors: Sequence[tuple[str, str]]) -> tuple[Segment, ...]:
        if self.rotor != EACH:
            return (self,)
        names = [name for name, group in rotors if group in self.groups]
        words = [re.sub(r"\W", "_", name, flags=re.ASCII) for name in names]
        return tuple(
            self.model_copy(update={"name": f"{self.name}_{word}", "rotor": name})
            for word, name in zip(words, names, strict=True)
        )
