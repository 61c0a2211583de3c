"""Climb on the wing."""

from typing import Literal

from lpc_mdo.config.segments.base import Sloping


class Climb(Sloping):
    kind: Literal["climb"]

    @property
    def vertical_rate(self) -> float:
        return self.rate
