"""Thrust and torque of the rotors in all segments, with gradients, by this package in one batch."""

from typing import Any

import torch
from torch import Tensor

from benchmarks.subject import Task
from benchmarks.subjects.rotors import BLADES, DENSITY, DRAG, DRAG_FACTOR, LIFT, LIFT_SLOPE, rotors
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum
from lpc_mdo.surrogates.airfoil import load_airfoil


def prepare(count: int, segments: int, polar: str) -> Task:
    """polar: "analytic", or "surrogate" for the one that the aircraft's model reads."""
    data = rotors(count, segments)
    radius, hub, speed = (torch.from_numpy(v) for v in (data.radius, data.hub_radius, data.speed))
    axial = torch.from_numpy(data.axial_velocity)[:, None].expand(segments, count)
    number = lambda value: torch.tensor(value, dtype=torch.float64)  # noqa: E731
    inflow = Inflow(axial, speed.expand(segments, count), number(DENSITY), number(340.3), number(1.79e-5))
    section = _analytic if polar == "analytic" else load_airfoil("naca4412")
    shape = torch.from_numpy(data.chord), torch.from_numpy(data.twist)

    def evaluate() -> dict[str, Tensor]:
        """Loads (segment, rotor) and their gradients (segment, rotor, station): rotors do not depend on each other."""
        chord, twist = (v.expand(segments, -1, -1).clone().requires_grad_() for v in shape)
        loads = blade_element_momentum(Rotor(radius, hub, chord, twist, number(float(BLADES))), inflow, section)
        thrust, torque = loads.thrust, loads.torque
        by_thrust = torch.autograd.grad(thrust.sum(), (chord, twist), retain_graph=True)
        by_torque = torch.autograd.grad(torque.sum(), (chord, twist))
        return {
            "thrust": thrust.detach(),
            "torque": torque.detach(),
            "thrust_by_chord": by_thrust[0],
            "thrust_by_twist": by_thrust[1],
            "torque_by_chord": by_torque[0],
            "torque_by_twist": by_torque[1],
        }

    def check() -> dict[str, Any]:
        return {name: values.tolist() for name, values in evaluate().items()}

    return Task(evaluate, check)


def _analytic(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
    lift = LIFT + LIFT_SLOPE * alpha
    return lift, DRAG + DRAG_FACTOR * lift**2
