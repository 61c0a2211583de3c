"""What checks of a layout share: how a fault is told, and where parts are."""

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from lpc_mdo.config import Fuselage, LiftingSurface, VerticalTail


class Fault(NamedTuple):
    """A key with its value, and what that must be."""

    key: str
    value: object
    rule: str

    def __str__(self) -> str:
        return f"{self.key} = {self.value} is invalid: it must {self.rule}"


def half_span(surface: "LiftingSurface") -> float:
    return 0.5 * math.sqrt(surface.area * surface.aspect_ratio)


def root_edges(surface: "LiftingSurface | VerticalTail") -> tuple[float, float]:
    """x of leading and trailing edge at the root, m."""
    span = math.sqrt(surface.area * surface.aspect_ratio)
    chord = 2.0 * surface.area / (span * (1.0 + surface.taper))
    x = surface.root_quarter_chord[0]
    return x - 0.25 * chord, x + 0.75 * chord


def fin_top(fin: "VerticalTail") -> float:
    """z of the fin's tip, m."""
    return fin.root_quarter_chord[2] + math.sqrt(fin.area * fin.aspect_ratio)


def axis_height(body: "Fuselage", x: float) -> float:
    """z of the body's axis at x, m."""
    share = min(max((x - body.nose[0]) / (body.rear[0] - body.nose[0]), 0.0), 1.0)
    return body.nose[2] + share * (body.rear[2] - body.nose[2])
