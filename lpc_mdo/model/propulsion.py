"""Motors behind the rotors: their operation at all points, and the share of their largest torque."""

from dataclasses import dataclass

from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.disciplines.motor import MotorOperation, operate_motor
from lpc_mdo.disciplines.motor_limits import maximum_torque
from lpc_mdo.disciplines.motor_sizing import Motor, MotorParameters, size_motor
from lpc_mdo.model.blade_airfoils import BladePolar
from lpc_mdo.model.design import Design
from lpc_mdo.model.rotors import RotorOperation
from lpc_mdo.model.schedule import Schedule

LEAST_TORQUE = 1e-3  # N m: keeps the share of a motor finite that no currents within its limits drive


@dataclass(frozen=True)
class Propulsion:
    """Rotors with their motors at the schedule's points (..., point)."""

    rotors: RotorOperation
    motors: Motor  # (..., rotor)
    solved_operation: MotorOperation  # (..., solved)
    torque_share: Tensor  # (..., point) air-gap torque over the motor's largest at the point's speed

    @property
    def schedule(self) -> Schedule:
        return self.rotors.schedule

    @property
    def loads(self) -> RotorLoads:
        """(..., point)."""
        return self.rotors.loads

    @property
    def polars(self) -> tuple[BladePolar, ...]:
        """One a point."""
        return self.rotors.polars

    @property
    def operation(self) -> MotorOperation:
        """(..., point)."""
        return self.solved_operation.at(self.schedule.place)


class Motors:
    """Callable stage: the motors of a design, and what they do behind given rotors."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.drive = vehicle.motors
        self.parameters = MotorParameters(dc_voltage=vehicle.motors.dc_voltage)

    def sized(self, design: Design) -> Motor:
        """(..., rotor)."""
        return size_motor(design.motor_diameter, design.motor_length, self.parameters)

    def __call__(self, motors: Motor, rotors: RotorOperation) -> Propulsion:
        schedule, loads, drive = rotors.schedule, rotors.solved_loads, self.drive
        circuit = motors.circuit.at(schedule.solved_rotor)
        torque = loads.torque / (drive.gear_ratio * drive.gear_efficiency)
        speed = loads.inflow.rotation_speed * drive.gear_ratio
        operation = operate_motor(circuit, torque, speed)
        share = operation.air_gap_torque / maximum_torque(circuit, speed).clamp(min=LEAST_TORQUE)
        return Propulsion(rotors, motors, operation, share[..., schedule.place])
