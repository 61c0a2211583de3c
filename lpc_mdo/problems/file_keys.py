"""Where a design variable's start stands in the vehicle or mission file, and its unit there."""

import math
from collections.abc import Callable

from lpc_mdo.config import Vehicle

DEGREES, RPM = 180.0 / math.pi, 30.0 / math.pi  # of a radian, of a radian per second


def _motor(size: str) -> Callable[[tuple[int, ...], Vehicle], str]:
    return lambda at, vehicle: f"motors.{'lift' if at[0] < len(vehicle.lift_rotors) else 'pusher'}_{size}_m"


_OF_VARIABLES: dict[str, tuple[Callable[[tuple[int, ...], Vehicle], str], float]] = {
    "rotor_radius": (lambda at, _: f"rotors[{at[0]}].radius_m", 1.0),
    "blade_twist": (lambda at, _: f"rotors[{at[0]}].twist_deg[{at[1]}]", DEGREES),
    "blade_chord": (lambda at, _: f"rotors[{at[0]}].chord_m[{at[1]}]", 1.0),
    "motor_length": (_motor("length"), 1.0),
    "motor_diameter": (_motor("bore"), 1.0),
    "wing_twist": (lambda at, _: "wing.incidence_deg", DEGREES),
    "battery_position": (lambda at, _: "battery.position_m[0]", 1.0),
    "lift_rotor_speed": (lambda at, _: f"rotors[{at[0]}].speed_rpm", RPM),
    "pusher_speed": (lambda at, vehicle: f"rotors[{len(vehicle.rotors) - 1}].speed_rpm", RPM),
}
"""Of the variables whose bounds do not follow from the file's own value: keys of the vehicle file, and units."""


def file_key(variable: str, at: tuple[int, ...], vehicle: Vehicle) -> tuple[str, float] | None:
    """Key in the vehicle file of the component `at` of a variable, and the factor to the file's unit; None: no such key."""
    if variable not in _OF_VARIABLES:
        return None
    key, factor = _OF_VARIABLES[variable]
    return key(at, vehicle), factor
