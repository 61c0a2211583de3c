"""Descent on the wing."""

from typing import Literal

from lpc_mdo.config.segments.base import Sloping


class Descent(Sloping):
    kind: Literal["descent"]

    @property
    def vertical_rate(self) -> float:
        return -self.rate
