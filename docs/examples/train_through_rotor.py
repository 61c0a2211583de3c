"""A neural network trained through the rotor model: it learns to pitch blades for any thrust, with no data set.

The loss is the rotor's own physics, so every gradient step runs through blade-element momentum theory in one batch.
"""

import torch

from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum
from lpc_mdo.numerics.bsplines import basis_matrix
from lpc_mdo.surrogates.airfoil import load_airfoil

STEPS, BATCH = 60, 12
LEAST, MOST = 1500.0, 4500.0  # N

generator = torch.Generator().manual_seed(0)
stations = (torch.arange(28, dtype=torch.float64) + 0.5) / 28
twist_basis = basis_matrix(stations, 4, 3)
air = standard_atmosphere(torch.tensor(76.2, dtype=torch.float64))
polar = load_airfoil("naca4412")


def rotor(twist: torch.Tensor) -> RotorLoads:
    """Baseline lift rotors at 1200 rpm with twist control points (batch, 4) rad."""
    shape = twist.shape[:-1]
    radius = torch.full(shape, 1.524, dtype=torch.float64)
    blades = Rotor(
        radius=radius,
        hub_radius=0.2 * radius,
        chord=torch.linspace(0.3, 0.1, 28, dtype=torch.float64).expand(*shape, 28),
        twist=twist @ twist_basis.T,
        blades=torch.full(shape, 2.0, dtype=torch.float64),
    )
    hover = Inflow(
        axial_velocity=torch.zeros(shape, dtype=torch.float64),
        rotation_speed=torch.full(shape, 125.66, dtype=torch.float64),
        density=air.density.expand(shape),
        speed_of_sound=air.speed_of_sound.expand(shape),
        dynamic_viscosity=air.dynamic_viscosity.expand(shape),
    )
    return blade_element_momentum(blades, hover, polar)


torch.manual_seed(0)
network = torch.nn.Sequential(torch.nn.Linear(1, 16), torch.nn.Tanh(), torch.nn.Linear(16, 4)).double()


def blades_for(thrust: torch.Tensor) -> torch.Tensor:
    """Twist control points (batch, 4) rad for thrusts (batch,) N: a correction of the baseline blade."""
    baseline = torch.deg2rad(torch.tensor([30.0, 23.3, 16.7, 10.0], dtype=torch.float64))
    scaled = (2.0 * thrust - LEAST - MOST) / (MOST - LEAST)
    return baseline + 0.2 * network(scaled[:, None])


def loss_of(thrust: torch.Tensor) -> torch.Tensor:
    """Missed thrust weighs most; then power, as a figure of merit."""
    loads = rotor(blades_for(thrust))
    return ((loads.thrust / thrust - 1.0) ** 2).mean() - 0.02 * loads.figure_of_merit.mean()


def worst_miss() -> float:
    """Largest relative thrust error over the range."""
    with torch.no_grad():
        wanted = torch.linspace(LEAST, MOST, 13, dtype=torch.float64)
        return float((rotor(blades_for(wanted)).thrust / wanted - 1.0).abs().max())


untrained = worst_miss()
optimizer = torch.optim.Adam(network.parameters(), lr=0.03)
for _ in range(STEPS):
    wanted = LEAST + (MOST - LEAST) * torch.rand(BATCH, generator=generator, dtype=torch.float64)
    optimizer.zero_grad()
    loss_of(wanted).backward()
    optimizer.step()
trained = worst_miss()

if __name__ == "__main__":
    print(
        f"largest thrust error over {LEAST:.0f} to {MOST:.0f} N: {untrained:.1%} before, {trained:.1%} after training"
    )
