"""Mass in pieces, and loads and supports at nodes: what the frames of wing, fuselage and tails share."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.disciplines.mass_properties import MassProperties, combine
from lpc_mdo.structures.frame import BeamSections, Topology, element_axes


@dataclass(frozen=True)
class Pieces:
    """mass (..., piece) kg, center (..., piece, 3) m, inertia (..., piece, 3, 3) kg m^2 about each piece's own centre."""

    mass: Tensor
    center: Tensor
    inertia: Tensor

    def total(self) -> MassProperties:
        return combine(self.mass, self.center, self.inertia)

    def take(self, which: slice) -> "Pieces":
        return Pieces(self.mass[..., which], self.center[..., which, :], self.inertia[..., which, :, :])

    def mirrored(self) -> "Pieces":
        """In the plane y = 0."""
        mirror = torch.tensor([1.0, -1.0, 1.0], dtype=self.mass.dtype)
        return Pieces(self.mass, self.center * mirror, self.inertia * mirror * mirror[:, None])


def join(*parts: Pieces) -> Pieces:
    return Pieces(
        torch.cat([p.mass for p in parts], dim=-1),
        torch.cat([p.center for p in parts], dim=-2),
        torch.cat([p.inertia for p in parts], dim=-3),
    )


def rods(mass: Tensor, ends: Tensor, axes: Tensor, spread_y: Tensor, spread_z: Tensor) -> Pieces:
    """Uniform rods (..., piece) between ends (..., piece, 2, 3); spreads: mean square local y and z of their mass, m^2."""
    reach = ((ends[..., 1, :] - ends[..., 0, :]) ** 2).sum(-1) / 12.0
    local = torch.stack([spread_y + spread_z, spread_z + reach, spread_y + reach], dim=-1)
    inertia = axes.transpose(-1, -2) @ (mass[..., None, None] * local[..., None] * axes)
    return Pieces(mass, ends.mean(-2), inertia)


def beam_rods(density: float, points: Tensor, topology: Topology, sections: BeamSections) -> Pieces:
    length, axes = element_axes(points, topology)
    area = sections.area
    return rods(
        density * area * length,
        points[..., topology.elements, :],
        axes,
        sections.second_moment_z / area,
        sections.second_moment_y / area,
    )


def hat_lumps(nodes: Tensor, density: Callable[[Tensor], Tensor]) -> Tensor:
    """Statically equivalent nodal values (..., node) of a line load given as density((..., node - 1, 6)) over
    nodes (..., node)."""
    abscissa, weight = (torch.tensor(v) for v in np.polynomial.legendre.leggauss(6))
    share = 0.5 * (1.0 + abscissa)
    step = (nodes[..., 1:] - nodes[..., :-1])[..., None]
    values = density(nodes[..., :-1, None] + share * step) * 0.5 * weight * step
    left, right = (values * (1.0 - share)).sum(-1), (values * share).sum(-1)
    edge = torch.zeros_like(left[..., :1])
    return torch.cat([left, edge], dim=-1) + torch.cat([edge, right], dim=-1)


def supports(nodes: int, held: Mapping[int, tuple[int, ...]]) -> Tensor:
    """(node, 6) bool from the held freedoms of each supported node."""
    is_fixed = torch.zeros(nodes, 6, dtype=torch.bool)
    for node, freedoms in held.items():
        is_fixed[node, list(freedoms)] = True
    return is_fixed


def nodal_loads(values: dict[int, Tensor]) -> Tensor:
    """(..., node, 6) from (..., node) by freedom."""
    zero = torch.zeros_like(next(iter(values.values())))
    return torch.stack([values.get(freedom, zero) for freedom in range(6)], dim=-1)
