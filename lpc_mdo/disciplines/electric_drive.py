"""What stands between battery and rotor besides the motor: inverter, cables, gearbox; and how far a motor may be overloaded.

Laws of gearboxes: Johnson, NDARC, NASA Design and Analysis of Rotorcraft, Theory (NASA/TP-20250010468), section 29-7.4, fitted to
helicopters, here for one motor, one gearbox and one rotor. So used, at 4000 to 6000 motor revolutions a minute, both are within 5 % of
the drive systems of NASA's quadrotor and side-by-side helicopter (397 and 255 lb); NASA did not publish the motors' speeds.
"""

import math

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import HORSEPOWER, POUND

# Goals of NASA's Electrified Aircraft Propulsion (AIAA 2017-4701). A 50 kW prototype of silicon carbide without filter has 26 kW/kg;
# SUAVE takes an efficiency of 0.95.
INVERTER_SPECIFIC_POWER = 19e3  # W/kg
INVERTER_EFFICIENCY = 0.99
GEARBOX_EFFICIENCY = 0.985  # ASSUMED: one planetary stage loses 1 to 2 %
SECOND_ROTOR_TORQUE = 3.0  # % of the drive's: ASSUMED, that of a tail rotor, the least in the population of AFDD83
ROTOR_SHAFT_SHARE = 0.13  # of gearbox and shaft, usual; 0.06 to 0.20
AFDD83_ERROR = 0.077  # mean error of 30 aircraft
AFDD00_ERROR = 0.086  # of 52
# kg/(W m), forth and back: Vahana's trade study in SUAVE and RCAIDE; an older version of SUAVE has 10e-6. Copper at 5 A/mm^2 and 800 V
# without insulation has 4.5e-6, and loses 0.2 % over 10 m, which is left out.
CABLE_SPECIFIC_MASS = 5.7e-6
SIGNAL_WIRE_MASS = 4.6e-3  # kg/m, and
SIGNAL_WIRES = 12  # of them in a bundle: the same trade study
COPPER_RESISTIVITY = 2.17e-8  # ohm m, at about 80 degrees Celsius, as the motor's
COPPER_HEAT = 8900.0 * 385.0  # J/(m^3 K)


def supplied_power(delivered: Tensor, *efficiencies: float | Tensor) -> Tensor:
    """Power (...,) W that goes into a chain of parts, each with its efficiency (...,), for what comes out, at least 0."""
    for efficiency in efficiencies:
        delivered = delivered / efficiency
    return delivered


def inverter_mass(power: Tensor, specific_power: float | Tensor = INVERTER_SPECIFIC_POWER) -> Tensor:
    """Mass (...,) kg of an inverter of rated power (...,) W, the largest of any segment; specific_power (...,) W/kg."""
    return power / specific_power


def cable_mass(power: Tensor, length: Tensor, specific_mass: float | Tensor = CABLE_SPECIFIC_MASS) -> Tensor:
    """Mass (...,) kg of the cables to a motor, from the largest power (...,) W and the run (...,) m one way."""
    return specific_mass * power * length


def signal_wire_mass(length: Tensor) -> Tensor:
    """Mass (...,) kg of a bundle of sensor and control wires over a run (...,) m."""
    return SIGNAL_WIRES * SIGNAL_WIRE_MASS * length


def gearbox_mass_afdd83(
    power: Tensor, motor_speed: Tensor, rotor_speed: Tensor, second_rotor_torque: float = SECOND_ROTOR_TORQUE
) -> Tensor:
    """Gearbox and rotor shaft (...,) kg of one rotor: rated power (...,) W, speeds (...,) rad/s, torque share in %.

    Raises ValueError unless power and speeds are positive.
    """
    power, motor_speed, rotor_speed = _of_the_law(power, motor_speed, rotor_speed)
    share = second_rotor_torque**0.0680
    mass: Tensor = POUND * 57.72 * share * power**0.8195 * (motor_speed / 1000.0) ** 0.0369 / rotor_speed**0.6379
    return mass


def gearbox_mass_afdd00(power: Tensor, motor_speed: Tensor, rotor_speed: Tensor) -> Tensor:
    """Gearbox and rotor shaft (...,) kg of one rotor, as `gearbox_mass_afdd83`. Raises ValueError as it does."""
    power, motor_speed, rotor_speed = _of_the_law(power, motor_speed, rotor_speed)
    return POUND * 95.7634 * power**0.78137 * motor_speed**0.09899 / rotor_speed**0.80686


def _of_the_law(power: Tensor, motor_speed: Tensor, rotor_speed: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Horsepower and revolutions a minute."""
    for name, value in (("power", power), ("motor_speed", motor_speed), ("rotor_speed", rotor_speed)):
        if bool((value <= 0.0).any()):
            raise ValueError(f"{name} = {float(value.detach().amin()):g} is invalid: it must be positive")
    per_minute = 30.0 / math.pi
    return power / HORSEPOWER, per_minute * motor_speed, per_minute * rotor_speed


def winding_time_constant(current_density: Tensor, temperature_rise: Tensor) -> Tensor:
    """Time constant (...,) s of a winding as one lump of copper.

    current_density (...,) A/m^2, rms, that it bears for ever, and how much warmer (...,) K than its surroundings that makes it:
    what the copper stores at that rise over the heat that then flows off.
    """
    return COPPER_HEAT * temperature_rise / (COPPER_RESISTIVITY * current_density**2)


def overload_ratio(duration: Tensor, time_constant: Tensor, preload: Tensor) -> Tensor:
    """Largest current (...,) over the continuous one for duration (...,) s, after a share preload (...,) of it for long.

    The copper then just reaches its continuous temperature: rise r after time t = k^2 (1 - e) + p^2 e of the continuous one, with
    e = exp(-t/time constant (...,) s). Torque follows current until iron saturates, magnets or the inverter's limit end it: EMRAX's 228
    is rated for 2.05 times its continuous torque (230 over 112 N m). Friction and iron loss are left out.
    """
    cooled = torch.exp(-duration / time_constant)
    heated = -torch.expm1(-duration / time_constant)
    return torch.sqrt((1.0 - preload**2 * cooled) / heated)
