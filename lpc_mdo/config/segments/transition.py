"""Between hover and flight on the wing, level, as a row of quasi-steady points."""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from lpc_mdo.config.segments.base import Segment, Wingborne
from lpc_mdo.config.tables import between, key

MOST_POINTS = 30


class Transition(Wingborne):
    """The aircraft gains or loses speed at one acceleration and is trimmed at the middle of equal intervals of speed.

    Groups that stop (default: those of the lift rotors) turn up to `rotor_stop_speed`; beyond it the wing carries alone.
    """

    kind: Literal["transition"]
    altitude: float = key("altitude_m", 0.0, 5000.0)
    start_speed: float = key("start_speed_m_per_s", 0.0, 120.0)
    end_speed: float = key("end_speed_m_per_s", 0.0, 120.0)
    rotor_stop_speed: float = key("rotor_stop_speed_m_per_s", 0.0, 120.0)
    stopping: tuple[str, ...] = Field(("lift",), max_length=20)
    steady_acceleration: float = key("acceleration_m_per_s2", 0.05, 10.0)
    count: Annotated[int, between(1, MOST_POINTS)] = Field(alias="points")
    default_rotors = ("lift", "pusher")

    @model_validator(mode="after")
    def _changes_speed(self) -> "Transition":
        if self.start_speed == self.end_speed:
            raise ValueError(
                f"end_speed_m_per_s = {self.end_speed:g} is invalid: it must differ from start_speed_m_per_s"
            )
        return self

    @property
    def flight_speed(self) -> float:
        return 0.5 * (self.start_speed + self.end_speed)

    @property
    def level_altitude(self) -> float:
        return self.altitude

    @property
    def acceleration(self) -> float:
        return self.steady_acceleration if self.end_speed > self.start_speed else -self.steady_acceleration

    @property
    def rotor_share(self) -> float:
        return max(1.0 - (self.flight_speed / max(self.rotor_stop_speed, 1e-3)) ** 2, 0.0)

    @property
    def given_duration(self) -> float:
        return (self.end_speed - self.start_speed) / self.acceleration

    def points(self, rotors: Sequence[tuple[str, str]]) -> tuple[Segment, ...]:
        step = (self.end_speed - self.start_speed) / self.count
        found = []
        for i in range(self.count):
            ends = self.start_speed + i * step, self.start_speed + (i + 1) * step
            is_on_wing = 0.5 * sum(ends) > self.rotor_stop_speed
            groups = tuple(group for group in self.groups if not (is_on_wing and group in self.stopping))
            changes = {"start_speed": ends[0], "end_speed": ends[1], "rotors": groups, "count": 1}
            found.append(self.model_copy(update={"name": f"{self.name}_{i + 1}", **changes}))
        return tuple(found)
