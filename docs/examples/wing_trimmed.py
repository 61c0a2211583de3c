"""Wing and tail alone: the pitch and tail deflection at which lift carries the weight and the moment vanishes.

Newton's method with the exact Jacobian of the vortex lattice: five evaluations.
"""

import torch

import lpc_mdo
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.geometry.actuation import Axis, rotate
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.numerics.constants import GRAVITY

MASS, SPEED, DENSITY = 3000.0, 57.6, 1.112  # kg, m/s, kg/m^3
CENTER_OF_GRAVITY = torch.tensor([3.4, 0.0, 2.0], dtype=torch.float64)  # m

vehicle, _ = lpc_mdo.baseline()
geometry = Geometry(vehicle)
shape = geometry(geometry.outer_mold_line.baseline_parameters())


def imbalance(controls: torch.Tensor) -> torch.Tensor:
    """Lift less weight, and pitching moment, both over the weight (and a metre); controls: pitch and deflection, rad."""
    pitch, deflection = controls
    stream = SPEED * torch.stack([torch.cos(pitch), torch.zeros_like(pitch), torch.sin(pitch)])
    tail = rotate(shape.tail_mesh, Axis.lateral(shape.tail_hinge), deflection)
    density = torch.tensor(DENSITY, dtype=torch.float64)
    loads = vortex_lattice([shape.wing_mesh, tail], stream, density, CENTER_OF_GRAVITY, is_symmetric=True)
    weight = MASS * GRAVITY
    return torch.stack([loads.lift / weight - 1.0, loads.moment[1] / weight])


controls = torch.zeros(2, dtype=torch.float64)
for _ in range(5):
    jacobian = torch.autograd.functional.jacobian(imbalance, controls)
    controls = controls - torch.linalg.solve(jacobian, imbalance(controls))

if __name__ == "__main__":
    pitch, deflection = torch.rad2deg(controls)
    print(f"pitch {float(pitch):.3f} degrees, tail {float(deflection):.3f} degrees trailing edge down")
    print(f"left over: {imbalance(controls).abs().max():.1e} of the weight")
