"""One lift rotor alone: twist, chord and speed for the largest figure of merit at a given thrust.

Disciplines need no aircraft and no configuration, and the optimizer takes any differentiable function.
"""

import torch

from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum
from lpc_mdo.numerics.bsplines import basis_matrix
from lpc_mdo.optimization import minimize
from lpc_mdo.surrogates.airfoil import load_airfoil

THRUST = 4000.0  # N
RADIUS = torch.tensor(1.524, dtype=torch.float64)  # m

stations = (torch.arange(28, dtype=torch.float64) + 0.5) / 28
twist_basis, chord_basis = basis_matrix(stations, 4, 3), basis_matrix(stations, 2, 1)
air = standard_atmosphere(torch.tensor(76.2, dtype=torch.float64))
polar = load_airfoil("naca4412")


def rotor(x: torch.Tensor) -> RotorLoads:
    """x (7,): twist control points (degrees / 10), chord (decimetres), speed (100 rad/s)."""
    blades = Rotor(
        radius=RADIUS,
        hub_radius=0.2 * RADIUS,
        chord=chord_basis @ (0.1 * x[4:6]),
        twist=twist_basis @ torch.deg2rad(10.0 * x[:4]),
        blades=torch.tensor(2.0, dtype=torch.float64),
    )
    hover = Inflow(
        axial_velocity=torch.zeros((), dtype=torch.float64),
        rotation_speed=100.0 * x[6],
        density=air.density,
        speed_of_sound=air.speed_of_sound,
        dynamic_viscosity=air.dynamic_viscosity,
    )
    return blade_element_momentum(blades, hover, polar)


start = torch.tensor([3.0, 2.3, 1.7, 1.0, 3.0, 1.0, 1.25], dtype=torch.float64)
result = minimize(
    lambda x: -rotor(x).figure_of_merit,
    start,
    lower=torch.tensor([0.3, 0.3, 0.3, 0.3, 0.5, 0.5, 0.5], dtype=torch.float64),
    upper=torch.tensor([6.0, 6.0, 6.0, 6.0, 5.0, 5.0, 1.9], dtype=torch.float64),
    constraints=lambda x: (rotor(x).thrust / THRUST)[None],
    constraint_lower=torch.ones(1, dtype=torch.float64),
    constraint_upper=torch.ones(1, dtype=torch.float64),
)
before, after = rotor(start), rotor(result.x)

if __name__ == "__main__":
    print(f"{result.status}: {result.message}")
    print(f"figure of merit {float(before.figure_of_merit):.4f} -> {float(after.figure_of_merit):.4f}")
    print(f"thrust {float(after.thrust):.1f} N, shaft power {float(after.power) / 1e3:.1f} kW")
    print(f"twist {[round(10 * float(t), 1) for t in result.x[:4]]} degrees, root to tip")
    print(f"chord {[round(0.1 * float(c), 3) for c in result.x[4:6]]} m, speed {100 * float(result.x[6]):.1f} rad/s")
