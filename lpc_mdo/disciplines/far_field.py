"""What a vortex lattice leaves behind: forces from its wake, and the loading along the span."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.vortex_lattice import stream_axes
from lpc_mdo.disciplines.vortex_topology import lattice_of


@dataclass(frozen=True)
class FarField:
    """Forces (...,) N of all surfaces from momentum and energy far behind them."""

    lift: Tensor
    side_force: Tensor
    induced_drag: Tensor

    def span_efficiency(self, span: Tensor, density: Tensor, speed: Tensor) -> Tensor:
        """Induced drag of an elliptic loading of the same lift and `span` (...,) m over this one's (...,)."""
        return self.lift**2 / (0.5 * density * speed**2 * math.pi * span**2 * self.induced_drag)


def far_field(
    circulation: Sequence[Tensor],
    trailing_edges: Sequence[Tensor],
    velocity: Tensor,
    density: Tensor,
    *,
    is_symmetric: bool = False,
    wake_core: float = 1.0,
) -> FarField:
    """Forces by the Trefftz-plane integral, for wakes that trail straight along the stream.

    circulation: per surface (..., spanwise) m^2/s, shed at the trailing edge; trailing_edges: per surface its corners
    (..., spanwise + 1, 3) m; velocity (..., 3) m/s; density (...,) kg/m^3; is_symmetric and wake_core as for the lattice.
    With the sheets' strips ds across the stream, D = -rho/2 sum Gamma (w . n) ds, the wash w that of all trailing legs at the
    strips' collocation points, and the force across the stream is rho V sum Gamma n ds. Source: Katz and Plotkin (2001), section 8.2.2.
    """
    speed = torch.linalg.vector_norm(velocity, dim=-1)
    _, starboard, up = stream_axes(velocity / speed[..., None])
    across = torch.stack([starboard, up], dim=-1)
    edges = [edge @ across for edge in trailing_edges]
    strip = torch.cat([edge[..., 1:, :] - edge[..., :-1, :] for edge in edges], dim=-2)
    strength = torch.cat(list(circulation), dim=-1)
    # Legs carry -Gamma at a strip's port end and +Gamma at its starboard end along the stream.
    shed = torch.cat(
        [torch.nn.functional.pad(g, (1, 0)) - torch.nn.functional.pad(g, (0, 1)) for g in circulation], dim=-1
    )
    leg = torch.cat(edges, dim=-2)
    lattice = lattice_of(tuple((1, edge.shape[-2] - 1) for edge in edges), has_core=wake_core > 0.0)
    middle = leg.index_select(-2, lattice.port) + lattice.collocation(strip)[..., None] * strip
    core = (wake_core * lattice.widths(leg)) ** 2
    apart = lattice.panels_apart.mT
    if is_symmetric:
        mirror = torch.tensor([-1.0, 1.0], dtype=leg.dtype, device=leg.device)
        leg, shed = torch.cat([leg, leg * mirror], dim=-2), torch.cat([shed, -shed], dim=-1)
        core, apart = torch.cat([core, core], dim=-1), torch.cat([apart, apart], dim=-1)
    arm = middle[..., :, None, :] - leg[..., None, :, :]
    squared = (arm * arm).sum(-1) + core[..., None, :] * apart
    # Without a core, a strip's middle on another surface's leg: the leg moves with it and induces nothing there.
    is_off = squared > torch.finfo(leg.dtype).eps * (strip * strip).sum(-1)[..., None]
    swirl = torch.where(is_off, shed[..., None, :], 0.0) / (2.0 * math.pi * torch.where(is_off, squared, 1.0))
    sidewash, upwash = -(swirl * arm[..., 1]).sum(-1), (swirl * arm[..., 0]).sum(-1)
    through = upwash * strip[..., 0] - sidewash * strip[..., 1]
    lift = density * speed * (strength * strip[..., 0]).sum(-1)
    side = -density * speed * (strength * strip[..., 1]).sum(-1)
    drag = -0.5 * density * (strength * through).sum(-1)
    if is_symmetric:
        lift, side, drag = 2.0 * lift, torch.zeros_like(side), 2.0 * drag
    return FarField(lift=lift, side_force=side, induced_drag=drag)


@dataclass(frozen=True)
class SpanLoading:
    """One surface strip by strip, (..., spanwise)."""

    station: Tensor  # (..., spanwise, 3) m, quarter-chord points of the strips' middles
    width: Tensor  # m along the span
    chord: Tensor  # m
    lift_per_length: Tensor  # N/m across stream and span
    lift_coefficient: Tensor  # of the section, on its chord and the free stream


def span_loading(mesh: Tensor, panel_force: Tensor, velocity: Tensor, density: Tensor) -> SpanLoading:
    """Section loads of a surface from its mesh (..., chordwise + 1, spanwise + 1, 3) m and panel forces (..., c, s, 3) N.

    velocity (..., 3) m/s, density (...,) kg/m^3. Lift is the force normal to the stream and to the strip's quarter-chord line.
    """
    front, rear = mesh[..., 0, :, :], mesh[..., -1, :, :]
    front, rear = (0.5 * (edge[..., 1:, :] + edge[..., :-1, :]) for edge in (front, rear))
    quarter = 0.75 * mesh[..., 0, :, :] + 0.25 * mesh[..., -1, :, :]
    line = quarter[..., 1:, :] - quarter[..., :-1, :]
    stream = velocity[..., None, :].expand_as(line)
    speed = torch.linalg.vector_norm(stream, dim=-1)
    normal = torch.linalg.cross(stream, line)
    normal = normal / torch.linalg.vector_norm(normal, dim=-1, keepdim=True)
    along = (line * stream).sum(-1) / speed
    width = torch.sqrt((line * line).sum(-1) - along**2)
    chord = torch.linalg.vector_norm(rear - front, dim=-1)
    lift = (panel_force.sum(-3) * normal).sum(-1) / width
    pressure = 0.5 * density[..., None] * speed**2
    return SpanLoading(
        station=0.75 * front + 0.25 * rear,
        width=width,
        chord=chord,
        lift_per_length=lift,
        lift_coefficient=lift / (pressure * chord),
    )
