"""Speed, path, pitch and air of every segment."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.atmosphere import Atmosphere, standard_atmosphere
from lpc_mdo.model.design import Design
from lpc_mdo.model.schedule import Schedule, altitude_name, end_altitude_name, flight_speed_name
from lpc_mdo.numerics.tensors import tensor


@dataclass(frozen=True)
class FlightConditions:
    """Each (..., segment)."""

    start_altitude: Tensor  # m
    end_altitude: Tensor  # m
    speed: Tensor  # m/s along the path
    vertical_rate: Tensor  # (segment,) m/s, positive upwards
    acceleration: Tensor  # (segment,) m/s^2 along the path
    load_factor: Tensor  # (segment,) lift normal to the path over weight
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
        self.vertical_rate = tensor([segment.vertical_rate for segment in segments])
        self.acceleration = tensor([segment.acceleration for segment in segments])
        self.load_factor = tensor([segment.load_factor for segment in segments])
        offsets = [s.temperature_offset for s in segments]
        self.temperature_offset = tensor([self.mission.temperature_offset if o is None else o for o in offsets])
        # Where pitch comes from: place 0 is level, then the wingborne segments in order.
        order = {int(i): k + 1 for k, i in enumerate(schedule.wingborne)}
        self.pitch_place = torch.tensor([order.get(i, 0) for i in range(len(segments))])

    def __call__(self, design: Design) -> FlightConditions:
        names, mission = self.schedule.segment_names, self.mission
        levels, ends, speeds = (
            self._chosen(design, name) for name in (altitude_name, end_altitude_name, flight_speed_name)
        )
        altitudes = [mission.altitudes(name, levels, ends) for name in names]
        start, end = (self._stacked(design, [pair[k] for pair in altitudes]) for k in (0, 1))
        speed = self._stacked(design, [mission.speed(name, speeds) for name in names])
        path_angle = torch.asin(self.vertical_rate / speed.where(speed > 0.0, 1.0))
        pitch = torch.nn.functional.pad(design.pitch, (1, 0))[..., self.pitch_place]
        air = standard_atmosphere(0.5 * (start + end), self.temperature_offset)
        steady = self.vertical_rate, self.acceleration, self.load_factor
        return FlightConditions(start, end, speed, *steady, path_angle, pitch, air)

    def _chosen(self, design: Design, variable: Callable[[str], str]) -> dict[str, Tensor]:
        """What the design has in place of the file's, by the segments' names; `variable`: the name of a segment's variable."""
        values = design.of_segments
        return {name: values[variable(name)] for name in self.schedule.segment_names if variable(name) in values}

    @staticmethod
    def _stacked(design: Design, values: Sequence[float | Tensor]) -> Tensor:
        """(..., segment)."""
        one = design.battery_mass
        return torch.stack([v if isinstance(v, Tensor) else torch.full_like(one, v) for v in values], dim=-1)
