"""Tones from first principles: a force and a displaced volume that circle, heard in retarded time; no Bessel functions."""

import math
from collections.abc import Sequence

import torch
from torch import Tensor


def moving_point_source(
    order: int,
    speed: float,
    radius: float,
    mach: float,
    observer: Sequence[float],
    thrust: float,
    drag: float,
    volume: float,
    density: float,
    speed_of_sound: float,
) -> tuple[float, float]:
    """rms pressures at `order` x speed of one blade's forces on the air and displaced volume, from first principles.

    The blade circles in the y-z plane, which moves along +x at `mach` with the observer. Emission times tau are uniform
    over a turn; reception times solve |observer(t) - source(tau)| = c (t - tau). Pressure: -div(force x Green's
    function) for the force and the second time derivative in air at rest for the volume.
    """
    x = torch.tensor(observer, dtype=torch.float64, requires_grad=True)
    azimuth = 2 * math.pi * torch.arange(256, dtype=torch.float64) / 256
    cos, sin, zero = torch.cos(azimuth), torch.sin(azimuth), torch.zeros_like(azimuth)
    flight, frequency = mach * speed_of_sound, order * speed
    arm = x - radius * torch.stack([zero, cos, sin], dim=-1)
    along, gap = arm[:, 0] * flight, speed_of_sound**2 - flight**2
    delay = (along + torch.sqrt(along**2 + gap * (arm**2).sum(-1))) / gap
    convection = 1.0 - (arm[:, 0] + flight * delay) * flight / (speed_of_sound**2 * delay)
    phase = order * azimuth + frequency * delay
    green = [wave(phase) / (4 * math.pi * speed_of_sound * delay * convection) for wave in (torch.cos, torch.sin)]

    def gradient(scalar: Tensor) -> Tensor:
        return torch.autograd.grad(scalar, x, create_graph=True)[0]

    force = torch.stack([torch.full_like(zero, -thrust), -drag * sin, drag * cos], dim=-1)
    loading = [-sum(gradient((force[:, i] * part).mean())[i].item() for i in range(3)) for part in green]

    # d/dt of air at rest is d/dt - V d/dx for the moving observer, -i w - V d/dx of the harmonic, here applied twice.
    mean = [part.mean() for part in green]
    first = [gradient(part)[0] for part in mean]
    second = [gradient(part)[0] for part in first]
    monopole = [
        density
        * volume
        * (flight**2 * second[i] - frequency**2 * mean[i] + sign * 2 * frequency * flight * first[j]).item()
        for i, j, sign in ((0, 1, -1), (1, 0, 1))
    ]
    return math.sqrt(2.0) * math.hypot(*loading), math.sqrt(2.0) * math.hypot(*monopole)
