"""Induced drag of the wing and its gradient, by this package."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.subject import Task
from benchmarks.subjects.wing import DENSITY, HALF_SPAN, SECTIONS, SPEED, interpolation, start
from lpc_mdo.disciplines.vortex_lattice import LatticeLoads, vortex_lattice


def prepare(chordwise: int, half: int, is_symmetric: bool = False) -> Task:
    """`half` panels across each half span; is_symmetric: the starboard half is solved, its mirror image added."""
    y = np.linspace(0.0, HALF_SPAN, half + 1) if is_symmetric else np.linspace(-HALF_SPAN, HALF_SPAN, 2 * half + 1)
    weights, across = torch.from_numpy(interpolation(y)), torch.from_numpy(y)
    along = torch.linspace(0.0, 1.0, chordwise + 1, dtype=torch.float64)[:, None]
    x0, density, origin = torch.from_numpy(start()), torch.tensor(DENSITY).double(), torch.zeros(3).double()

    def loads(x: Tensor, wake: Tensor | None) -> LatticeLoads:
        chord, twist = weights @ x[:SECTIONS], weights @ x[SECTIONS:-1]
        behind = along * chord
        rows = (behind * torch.cos(twist) - 0.25 * chord, across.expand_as(behind), -behind * torch.sin(twist))
        stream = torch.stack([torch.cos(x[-1]), torch.zeros_like(x[-1]), torch.sin(x[-1])])
        mesh, velocity = torch.stack(rows, dim=-1), SPEED * stream
        return vortex_lattice([mesh], velocity, density, origin, is_symmetric=is_symmetric, wake_direction=wake)

    def evaluate(wake: Tensor | None = None) -> tuple[LatticeLoads, Tensor]:
        x = x0.clone().requires_grad_()
        found = loads(x, wake)
        (gradient,) = torch.autograd.grad(found.induced_drag, x)
        return found, gradient

    def check() -> dict[str, Any]:
        """With the wake along the stream, and along the wing's plane as AeroSandbox lays it."""
        wakes = {"stream": None, "plane": torch.tensor([1.0, 0.0, 0.0]).double()}
        results = {name: evaluate(wake) for name, wake in wakes.items()}
        return {
            name: {
                "lift": found.lift.item(),
                "drag": found.induced_drag.item(),
                "gradient": gradient.tolist(),
            }
            for name, (found, gradient) in results.items()
        }

    return Task(evaluate, check)
