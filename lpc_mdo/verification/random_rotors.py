"""Rotors and operating conditions at random: does the inflow equation always have its root?"""

import math

import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum
from lpc_mdo.numerics.implicit import RootNotFoundError
from lpc_mdo.surrogates.airfoil import load_airfoil

BATCH = 5000
STATIONS = 4
RESIDUAL_LIMIT = 1e-11  # of the inflow equation over the velocity


def random_conditions(count: int, stations: int = 8, seed: int = 2026) -> tuple[Rotor, Inflow]:
    """Hover, climb, descent into vortex ring and windmill, high advance ratio, feathered and reversed pitch."""
    generator = torch.Generator().manual_seed(seed)

    def between(low: float, high: float) -> Tensor:
        return low + (high - low) * torch.rand(count, 1, generator=generator, dtype=torch.float64)

    radius = between(0.2, 4.0)[:, 0]
    pitch = between(-math.pi / 2, math.pi / 2)
    washout = torch.linspace(0.3, -0.1, stations, dtype=torch.float64)
    chord = between(0.01, 0.3) * radius[:, None] * torch.ones(stations, dtype=torch.float64)
    blades = torch.randint(1, 8, (count,), generator=generator).double()
    rotor = Rotor(radius, 0.2 * radius, chord, pitch + washout, blades)
    axial = torch.where(between(0.0, 1.0) < 0.2, 0.0, between(-60.0, 100.0))[:, 0]
    speed = between(1.0, 300.0)[:, 0] / radius
    air = [between(0.4, 1.3)[:, 0], between(300.0, 350.0)[:, 0], between(1.4e-5, 1.9e-5)[:, 0]]
    return rotor, Inflow(axial, speed, *air)


def still_air(rotation_speed: Tensor) -> Inflow:
    """Hover near sea level at rotation_speed (...,) rad/s."""
    one = torch.ones_like(rotation_speed)
    return Inflow(0.0 * one, rotation_speed, 1.2 * one, 340.0 * one, 1.8e-5 * one)


def failures(count: int, seed: int = 0) -> int:
    """How many of `count` random conditions fail: no root, a residual above the limit, loads that are not finite."""
    polar, failed = load_airfoil(), 0
    for part, start in enumerate(range(0, count, BATCH)):
        size = min(BATCH, count - start)
        rotor, inflow = random_conditions(size, STATIONS, seed + part)
        try:
            with torch.no_grad():
                loads = blade_element_momentum(rotor, inflow, polar)
        except RootNotFoundError:
            failed += size  # at least one of the batch
            continue
        is_sound = (loads.residual.abs() < RESIDUAL_LIMIT).all(-1)
        for values in (loads.thrust, loads.torque, loads.power):
            is_sound = is_sound & values.isfinite()
        failed += int((~is_sound).sum())
    return failed
