"""Thrust and torque of the rotors, with gradients, by CCBlade (WISDEM), one rotor and segment after the other.

CCBlade is for turbines: the polar is mirrored, and loads change their signs.
"""

from typing import Any

import numpy as np
from wisdem.ccblade.ccblade import CCAirfoil, CCBlade

from benchmarks.subject import Task
from benchmarks.subjects.rotors import (
    BLADES,
    DENSITY,
    DRAG,
    DRAG_FACTOR,
    LIFT,
    LIFT_SLOPE,
    STATIONS,
    Rotors,
    rotors,
)


class _Analytic:
    """The polar as a formula, with the methods that CCBlade calls: the least that it can cost."""

    def evaluate(self, alpha: float, reynolds: float) -> tuple[float, float]:
        lift = LIFT_SLOPE * alpha - LIFT
        return lift, DRAG + DRAG_FACTOR * lift * lift

    def derivatives(self, alpha: float, reynolds: float) -> tuple[float, float, float, float]:
        return LIFT_SLOPE, 0.0, 2.0 * DRAG_FACTOR * (LIFT_SLOPE * alpha - LIFT) * LIFT_SLOPE, 0.0


def _spline() -> CCAirfoil:
    """The same polar as CCBlade's own spline through a table."""
    degrees = np.linspace(-180.0, 180.0, 721)
    lift = LIFT_SLOPE * np.radians(degrees) - LIFT
    return CCAirfoil(degrees, [1e6], lift, DRAG + DRAG_FACTOR * lift**2)


def prepare(count: int, segments: int, polar: str) -> Task:
    """polar: "analytic", or "spline" for CCBlade's own class."""
    data = rotors(count, segments)
    section = _Analytic() if polar == "analytic" else _spline()

    def check() -> dict[str, Any]:
        rows = [[_loads(data, i, velocity, section) for i in range(count)] for velocity in data.axial_velocity]
        return {name: [[rotor[name] for rotor in row] for row in rows] for name in rows[0][0]}

    return Task(check, check)


def _loads(data: Rotors, i: int, velocity: float, section: Any) -> dict[str, Any]:
    """Loads of a rotor, and their gradients (station,), integrated by mid-points."""
    radius, width = (values[i] for values in data.stations())
    blade = CCBlade(
        radius,
        data.chord[i],
        np.degrees(data.twist[i]),
        [section] * STATIONS,
        data.hub_radius[i],
        data.radius[i],
        B=BLADES,
        rho=DENSITY,
        shearExp=0.0,
        nSector=1,
        hubloss=False,
        derivatives=True,
    )
    loads, derivatives = blade.distributedAeroLoads(velocity, 30.0 / np.pi * data.speed[i], 0.0, 0.0)
    by_thrust, by_torque = (-BLADES * width * np.ones(STATIONS), -BLADES * width * radius)
    per_radian = 180.0 / np.pi
    return {
        "thrust": float(by_thrust @ loads["Np"]),
        "torque": float(by_torque @ loads["Tp"]),
        "thrust_by_chord": (by_thrust @ derivatives["dNp"]["dchord"]).tolist(),
        "thrust_by_twist": (per_radian * by_thrust @ derivatives["dNp"]["dtheta"]).tolist(),
        "torque_by_chord": (by_torque @ derivatives["dTp"]["dchord"]).tolist(),
        "torque_by_twist": (per_radian * by_torque @ derivatives["dTp"]["dtheta"]).tolist(),
    }
