"""Segments of a mission by kind: one file each, one line here."""

from typing import Annotated

from pydantic import Field

from lpc_mdo.config.segments.base import Hovering, Segment, Wingborne
from lpc_mdo.config.segments.climb import Climb
from lpc_mdo.config.segments.cruise import Cruise
from lpc_mdo.config.segments.descent import Descent
from lpc_mdo.config.segments.hover import Hover
from lpc_mdo.config.segments.load_factor import LoadFactor
from lpc_mdo.config.segments.loiter import Loiter
from lpc_mdo.config.segments.rotor_inoperative import RotorInoperative
from lpc_mdo.config.segments.transition import Transition
from lpc_mdo.config.segments.vertical_climb import VerticalClimb
from lpc_mdo.config.segments.vertical_descent import VerticalDescent

AnySegment = Annotated[
    Hover
    | VerticalClimb
    | VerticalDescent
    | Transition
    | Climb
    | Cruise
    | Loiter
    | Descent
    | RotorInoperative
    | LoadFactor,
    Field(discriminator="kind"),
]

__all__ = ["AnySegment", "Hovering", "Segment", "Wingborne"]
