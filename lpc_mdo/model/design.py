"""The design: every quantity that an optimization may change, by name, in SI units."""

from dataclasses import dataclass

from torch import Tensor


@dataclass(frozen=True)
class Design:
    """Leading dimensions batch; the last dimensions are given below. Rotors come in the order of the vehicle file."""

    rotor_radius: Tensor  # (..., rotor) m
    blade_twist: Tensor  # (..., rotor, 4) rad, B-spline control points from root to tip, as many as the file has
    blade_chord: Tensor  # (..., rotor, 2) m, likewise
    motor_length: Tensor  # (..., rotor) m, active length
    motor_diameter: Tensor  # (..., rotor) m
    wing_area: Tensor  # (...,) m^2
    wing_aspect_ratio: Tensor  # (...,)
    wing_twist: Tensor  # (..., 5) rad, root to tip, nose up
    tail_area: Tensor  # (...,) m^2
    tail_aspect_ratio: Tensor  # (...,)
    tail_position: Tensor  # (...,) m, x of the root quarter chord
    battery_mass: Tensor  # (...,) kg
    battery_position: Tensor  # (...,) m, x of its centre of gravity
    lift_rotor_speed: Tensor  # (..., lift rotor) rad/s, hover
    pusher_speed: Tensor  # (..., 2) rad/s, climb and cruise
    pitch: Tensor  # (..., 2) rad, climb and cruise
    tail_deflection: Tensor  # (..., 2) rad, climb and cruise, trailing edge down
    cruise_altitude: Tensor  # (...,) m
    climb_end_altitude: Tensor  # (...,) m
    cruise_speed: Tensor | None = None  # (...,) m/s; None: the mission's, which `Analysis.design` then carries
