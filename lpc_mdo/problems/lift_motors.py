"""Lower bounds of the lift motors: the published study sets them so high that the motors' torque limit needs no row.

The rule, from the aircraft's own hover torque. Each lift rotor carries its share of the start's weight at the figure of merit of the
file's own blades, at the slowest speed a designer may choose: that at which blades of the largest chord in the bounds carry it with
a mean lift coefficient of one. Torque is power over that speed,

    power = T^1.5 / (FM sqrt(2 rho A)),   speed^2 = 6 T / (c_l rho blades chord R^3),

and the bounds are those of the smallest motor in the file's proportions that gives it through the gearbox.
"""

import math
from dataclasses import dataclass

import torch

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines.motor_limits import maximum_torque
from lpc_mdo.disciplines.motor_sizing import MotorParameters, size_motor
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.numerics.constants import GRAVITY

MEAN_LIFT_COEFFICIENT = 1.0  # top of the 0.6 to 1.0 of public sizing codes (convexengineering/eVTOL)
STEPS = 60  # of the bisection: to the last place


@dataclass(frozen=True)
class LeastMotor:
    """Active length and bore (m) of the smallest lift motor, the rotor torque (N m) that it must give, and at which rad/s."""

    length: float
    bore: float
    rotor_torque: float
    rotor_speed: float

    @property
    def reason(self) -> str:
        rpm = self.rotor_speed * 30.0 / math.pi
        return (
            f"rule: the smallest motor that gives the aircraft's own hover torque, {self.rotor_torque:.0f} N m "
            f"a rotor at {rpm:.0f} rpm"
        )


def least_lift_motor(vehicle: Vehicle, start: Analysis) -> LeastMotor:
    """The lower bounds of the rule above; `start` is the analysis of the file's own design.

    Both grow from the file's lower bounds in the proportions of its motor, each up to its upper bound.
    """
    points = [k for name in start.schedule.segment_names for k in _lifting(start, name)]
    torque, speed = max(_hover_torque(vehicle, start, point) for point in points)
    bounds, motors = vehicle.bounds, vehicle.motors
    lengths, bores = bounds.lift_motor_length, bounds.lift_motor_diameter
    parameters, gear = MotorParameters(dc_voltage=motors.dc_voltage), motors.gear_ratio
    needed = torque / (gear * motors.gear_efficiency)

    def size(scale: float) -> tuple[float, float]:
        length, bore = scale * motors.lift_length, scale * motors.lift_bore
        return min(max(length, lengths.lower), lengths.upper), min(max(bore, bores.lower), bores.upper)

    def gives(scale: float) -> bool:
        length, bore = (torch.tensor(value, dtype=torch.float64) for value in size(scale))
        motor_speed = torch.tensor(gear * speed, dtype=torch.float64)
        return float(maximum_torque(size_motor(bore, length, parameters).circuit, motor_speed)) >= needed

    low = min(lengths.lower / motors.lift_length, bores.lower / motors.lift_bore)
    high = max(lengths.upper / motors.lift_length, bores.upper / motors.lift_bore)
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gives(middle) else (middle, high)
    return LeastMotor(*size(high), torque, speed)


def _lifting(start: Analysis, segment: str) -> list[int]:
    """Points of the lift rotors that turn in a segment flown on them."""
    schedule = start.schedule
    return [k for k in schedule.in_segment(segment) if not (schedule.is_propelling[k] or schedule.is_edgewise[k])]


def _hover_torque(vehicle: Vehicle, start: Analysis, point: int) -> tuple[float, float]:
    """Torque N m of one lift rotor and the rotor speed rad/s at which it is asked."""
    schedule = start.schedule
    of_file, chord = vehicle.rotors[schedule.rotor[point]], vehicle.bounds.blade_chord.upper
    segment = int(schedule.segment[point])
    thrust = float(start.gross_mass) * GRAVITY / len(_lifting(start, schedule.segment_names[segment]))
    density, radius = float(start.flight.air.density[..., segment]), of_file.radius
    merit = float(start.rotors.efficiency[..., point])
    power = thrust**1.5 / (merit * math.sqrt(2.0 * density * math.pi) * radius)
    blade_area = of_file.blades * chord * radius
    tip_speed = math.sqrt(6.0 * thrust / (MEAN_LIFT_COEFFICIENT * density * blade_area))
    return power * radius / tip_speed, tip_speed / radius
