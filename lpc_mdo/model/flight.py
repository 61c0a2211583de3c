"""Speed, path, pitch and air of every segment."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.atmosphere import Atmosphere, standard_atmosphere
from lpc_mdo.model.design import Design
from lpc_mdo.model.schedule import Schedule, altitude_name, end_altitude_name, flight_speed_name


@dataclass(frozen=True)
class FlightConditions:
    """Each (..., segment)."""

    start_altitude: Tensor  # m
    end_altitude: Tensor  # m
    speed: Tensor  # m/s along the path
    vertical_rate: Tensor  # (segment,) m/s, positive upwards
    path_angle: Tensor  # rad
    pitch: Tensor  # rad
    air: Atmosphere  # in the middle between both altitudes

    @property
    def angle_of_attack(self) -> Tensor:
        return self.pitch - self.path_angle

    @property
    def ground_speed(self) -> Tensor:
        """m/s."""
        return torch.sqrt(self.speed**2 - self.vertical_rate**2)


class Flight:
    """Callable stage: Design -> FlightConditions. Raises ValueError for an altitude outside the atmosphere's layer."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule, self.mission = schedule, schedule.mission
        segments = schedule.segments
        self.vertical_rate = _tensor([segment.vertical_rate for segment in segments])
        offsets = [s.temperature_offset for s in segments]
        self.temperature_offset = _tensor([self.mission.temperature_offset if o is None else o for o in offsets])
        # Where pitch comes from: place 0 is level, then the wingborne segments in order.
        order = {int(i): k + 1 for k, i in enumerate(schedule.wingborne)}
        self.pitch_place = torch.tensor([order.get(i, 0) for i in range(len(segments))])

    def __call__(self, design: Design) -> FlightConditions:
        start, end = (torch.stack(altitudes, dim=-1) for altitudes in zip(*self._altitudes(design), strict=True))
        speed = torch.stack([self._speed(design, name) for name in self.schedule.segment_names], dim=-1)
        path_angle = torch.asin(self.vertical_rate / speed.where(speed > 0.0, 1.0))
        pitch = torch.nn.functional.pad(design.pitch, (1, 0))[..., self.pitch_place]
        air = standard_atmosphere(0.5 * (start + end), self.temperature_offset)
        return FlightConditions(start, end, speed, self.vertical_rate, path_angle, pitch, air)

    def _speed(self, design: Design, name: str) -> Tensor:
        """(...,) m/s: the design's, or the file's; that of another segment where it follows that."""
        given = self.mission.segment(name).flight_speed
        if isinstance(given, str):
            return self._speed(design, given)
        variable = design.of_segments.get(flight_speed_name(name))
        return torch.full_like(design.battery_mass, given) if variable is None else variable

    def _altitudes(self, design: Design) -> list[tuple[Tensor, Tensor]]:
        """(...,) m at begin and end of each segment."""
        found: dict[str, tuple[Tensor, Tensor]] = {}
        mission = self.mission

        def of(name: str) -> tuple[Tensor, Tensor]:
            if name not in found:
                found[name] = level(name) if mission.segment(name).level_altitude is not None else between(name)
            return found[name]

        def level(name: str) -> tuple[Tensor, Tensor]:
            variable = design.of_segments.get(altitude_name(name))
            file = mission.segment(name).level_altitude
            altitude = torch.full_like(design.battery_mass, file) if variable is None else variable
            return altitude, altitude

        def between(name: str) -> tuple[Tensor, Tensor]:
            before, after, end = mission.before(name), mission.after(name), mission.segment(name).given_end_altitude
            variable = design.of_segments.get(end_altitude_name(name))
            start = of(before.name)[1]
            if variable is not None:
                return start, variable
            return start, of(after.name)[0] if end is None else torch.full_like(start, end)

        return [of(name) for name in self.schedule.segment_names]


def _tensor(values: object) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)
