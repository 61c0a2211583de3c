"""The rotors that all blade-element codes are asked for: nine of slightly different shape and speed in three segments."""

from dataclasses import dataclass

import numpy as np

STATIONS = 28
BLADES = 2
DENSITY = 1.1  # kg/m^3
AXIAL_VELOCITY = (1e-4, 5.0, 12.0)  # m/s; CCBlade returns no loads at exactly zero
LIFT, LIFT_SLOPE, DRAG, DRAG_FACTOR = (
    0.45,
    5.9,
    0.009,
    0.008,
)  # cl = LIFT + LIFT_SLOPE alpha, cd = DRAG + DRAG_FACTOR cl^2


@dataclass(frozen=True)
class Rotors:
    """Per rotor: radii m, chord (rotor, station) m, twist (rotor, station) rad, speed rad/s; axial velocity by segment, m/s."""

    radius: np.ndarray
    hub_radius: np.ndarray
    chord: np.ndarray
    twist: np.ndarray
    speed: np.ndarray
    axial_velocity: np.ndarray

    def stations(self) -> tuple[np.ndarray, np.ndarray]:
        """Mid-points (rotor, station) of equal intervals from hub to tip, and their width (rotor, 1), m."""
        width = ((self.radius - self.hub_radius) / STATIONS)[:, None]
        return self.hub_radius[:, None] + width * (np.arange(STATIONS) + 0.5), width


def rotors(count: int, segments: int) -> Rotors:
    """Lift rotors and their conditions; three segments: hover, slow and fast climb."""
    share = (np.arange(STATIONS) + 0.5) / STATIONS
    spread = np.linspace(-0.5, 0.5, count)
    radius = 1.5 + 0.1 * spread
    return Rotors(
        radius=radius,
        hub_radius=0.2 * radius,
        chord=(0.25 + 0.02 * spread)[:, None] - 0.13 * share,
        twist=np.radians((22.0 + 2.0 * spread)[:, None] - 14.0 * share),
        speed=(1400.0 + 100.0 * spread) * np.pi / 30.0,
        axial_velocity=np.array(AXIAL_VELOCITY) if segments == 3 else np.linspace(0.1, 12.0, segments),
    )
