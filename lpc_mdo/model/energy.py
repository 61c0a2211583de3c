"""Time, electrical power and the battery along the flights and the reserve."""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.battery import BatteryState, energy_state_of_charge
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, TheveninState, pack_discharge
from lpc_mdo.disciplines.motor import MotorOperation
from lpc_mdo.model.design import Design
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.numerics.present import present


@dataclass(frozen=True)
class MissionEnergy:
    """Electrical power and time of each segment (..., segment), and the battery along the flown sequence."""

    power: Tensor  # W
    duration: Tensor  # s, each time that it is flown
    reserve_duration: Tensor  # (...,) s
    flown_power: Tensor  # (..., leg) W: the flights one after another, then the reserve
    flown_duration: Tensor  # (..., leg) s
    battery: BatteryState | TheveninState  # as vehicle.battery.model says


class Energy:
    """Callable stage: design, flight conditions and motors (..., solved) -> MissionEnergy."""

    def __init__(self, schedule: Schedule) -> None:
        self.schedule, self.mission, self.battery = schedule, schedule.mission, schedule.vehicle.battery
        count = len(schedule.segments)
        of_segment = torch.nn.functional.one_hot(schedule.solved_segment, count).double()
        self.sums = schedule.multiplicity[:, None] * of_segment  # (solved, segment)
        self.main = schedule.segment_index(self.mission.main_segment.name)

    def __call__(self, design: Design, flight: FlightConditions, motors: MotorOperation) -> MissionEnergy:
        battery = self.battery
        power = motors.input_power @ self.sums
        duration = torch.stack(self._durations(flight), dim=-1)
        reserve = self.mission.reserve
        speed = flight.speed[..., self.main]
        reserve_time = (
            reserve.distance / speed
            if reserve.distance is not None
            else torch.full_like(speed, present(reserve.duration, "reserve.duration_s"))
        )
        flown = self.schedule.flown
        flown_power = power[..., flown]
        flown_time = torch.cat([duration[..., flown[:-1]], reserve_time[..., None]], dim=-1)
        state: BatteryState | TheveninState
        if battery.model == "equivalent_circuit":
            state = pack_discharge(LG_M50, flown_power, flown_time, design.battery_mass, battery.specific_energy)
        else:
            state = energy_state_of_charge(
                flown_power, flown_time, design.battery_mass, battery.specific_energy, battery.discharge_efficiency
            )
        return MissionEnergy(power, duration, reserve_time, flown_power, flown_time, state)

    def _durations(self, flight: FlightConditions) -> list[Tensor]:
        """(...,) s of each segment: given, or what a change of altitude takes, or what a distance takes."""
        schedule, found = self.schedule, []
        rise, ground_speed = flight.end_altitude - flight.start_altitude, flight.ground_speed
        for i, segment in enumerate(schedule.segments):
            if segment.given_duration is not None:
                found.append(torch.full_like(flight.speed[..., i], segment.given_duration))
            elif segment.given_distance is None:
                found.append(rise[..., i] / segment.vertical_rate)
            else:
                covered: Tensor | float = 0.0
                for name in self.mission.credited(segment.name):
                    k = schedule.segment_index(name)
                    covered = covered + rise[..., k] / schedule.segments[k].vertical_rate * ground_speed[..., k]
                found.append((segment.given_distance - covered) / flight.speed[..., i])
        return found
