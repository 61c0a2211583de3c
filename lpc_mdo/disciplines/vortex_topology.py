"""How the nodes, filaments and rings of a vortex lattice hang together, and sums over their neighbourhoods."""

from dataclasses import dataclass
from functools import cache

import torch
from torch import Tensor


@dataclass(frozen=True)
class Lattice:
    """How nodes, filaments and rings of several surfaces hang together; every array is flat, surface after surface.

    Surface k has (chordwise + 1)(spanwise + 1) nodes. Its filaments are the spanwise front legs, port to starboard, and the
    chordwise legs, front to rear; after those of all surfaces follow the legs that trail to infinity from the last row.
    """

    shapes: tuple[tuple[int, int], ...]  # panels chordwise, spanwise
    first: Tensor  # (finite,) node where a finite filament begins
    last: Tensor  # (finite,) node where it ends
    shedding: Tensor  # (leg,) node from which a leg trails
    corners: Tensor  # (4, panel) nodes of each panel: front port, front starboard, rear port, rear starboard
    behind: Tensor  # (node,) the node behind each, the last row's own
    bound: Tensor  # (panel,) finite filament at the front of each panel
    panels_apart: Tensor  # (leg, panel) whether the panel belongs to another surface than the leg
    finite_apart: Tensor  # (leg, finite) whether the finite filament does

    @property
    def finite_sizes(self) -> list[int]:
        """Spanwise and chordwise filaments of every surface in turn."""
        return [size for c, s in self.shapes for size in (c * s, c * (s + 1))]

    @property
    def leg_sizes(self) -> list[int]:
        return [s + 1 for _, s in self.shapes]

    @property
    def panel_sizes(self) -> list[int]:
        return [c * s for c, s in self.shapes]

    def rings(self, filaments: Tensor) -> Tensor:
        """Sum around each ring (..., panel, n) of values (..., filament, n): front, starboard, less rear and port."""
        parts = filaments.split([*self.finite_sizes, *self.leg_sizes], dim=-2)
        count = len(self.shapes)
        result = []
        for k, (c, s) in enumerate(self.shapes):
            across, along = parts[2 * k].unflatten(-2, (c, s)), parts[2 * k + 1].unflatten(-2, (c, s + 1))
            leg = parts[2 * count + k]
            rear = torch.cat([-across[..., 1:, :, :], (leg[..., 1:, :] - leg[..., :-1, :])[..., None, :, :]], dim=-3)
            result.append((across + along[..., 1:, :] - along[..., :-1, :] + rear).flatten(-3, -2))
        return torch.cat(result, dim=-2) if count > 1 else result[0]

    def widths(self, edges: Tensor) -> Tensor:
        """Mean width (..., leg) m of the strips on either side of each leg, for legs that trail from edges (..., leg, 3) m."""
        result = []
        for edge in edges.split(self.leg_sizes, dim=-2):
            strip = torch.linalg.vector_norm(edge[..., 1:, :] - edge[..., :-1, :], dim=-1)
            result.append(
                0.5 * (torch.cat([strip[..., :1], strip], dim=-1) + torch.cat([strip, strip[..., -1:]], dim=-1))
            )
        return torch.cat(result, dim=-1)

    def strengths(self, circulation: Tensor) -> Tensor:
        """Circulation (..., filament) of the filaments between rings of circulation (..., panel): the transpose of `rings`."""
        finite, legs = [], []
        for part, shape in zip(circulation.split(self.panel_sizes, dim=-1), self.shapes, strict=True):
            grid = torch.nn.functional.pad(part.unflatten(-1, shape), (1, 1, 1, 0))
            across = grid[..., 1:, 1:-1] - grid[..., :-1, 1:-1]
            along = grid[..., 1:, :-1] - grid[..., 1:, 1:]
            finite += [across.flatten(-2), along.flatten(-2)]
            legs.append(along[..., -1, :])
        return torch.cat(finite + legs, dim=-1)

    def on_panels(self, finite: Tensor) -> Tensor:
        """Values of the finite filaments (..., finite, n) shared out to the panels (..., panel, n).

        A panel gets its front leg's and half of its side legs', of an outermost leg the whole.
        """
        parts = finite.split(self.finite_sizes, dim=-2)
        result = []
        for k, (c, s) in enumerate(self.shapes):
            along = parts[2 * k + 1].unflatten(-2, (c, s + 1))
            half = 0.5 * (along[..., :-1, :] + along[..., 1:, :])
            port = torch.nn.functional.pad(0.5 * along[..., :1, :], (0, 0, 0, s - 1))
            starboard = torch.nn.functional.pad(0.5 * along[..., -1:, :], (0, 0, s - 1, 0))
            result.append(parts[2 * k] + (half + port + starboard).flatten(-3, -2))
        return torch.cat(result, dim=-2)

    def at_nodes(self, filaments: Tensor) -> Tensor:
        """Sum over the filaments that meet in each node (..., node, n) of values (..., filament, n). Carries no gradient."""
        parts = filaments.split([*self.finite_sizes, *self.leg_sizes], dim=-2)
        sums = filaments.new_zeros(*filaments.shape[:-2], len(self.behind), filaments.shape[-1])
        nodes = sums.split([(c + 1) * (s + 1) for c, s in self.shapes], dim=-2)
        for k, (c, s) in enumerate(self.shapes):
            grid = nodes[k].unflatten(-2, (c + 1, s + 1))
            across, along = parts[2 * k].unflatten(-2, (c, s)), parts[2 * k + 1].unflatten(-2, (c, s + 1))
            grid[..., :-1, :-1, :] += across
            grid[..., :-1, 1:, :] += across
            grid[..., :-1, :, :] += along
            grid[..., 1:, :, :] += along
            grid[..., -1, :, :] += parts[2 * len(self.shapes) + k]
        return sums


@cache
def lattice_of(shapes: tuple[tuple[int, int], ...]) -> Lattice:
    """Topology of surfaces with these numbers of panels along chord and span, one after the other."""
    first, last, shedding, corners, behind, bound = [], [], [], [], [], []
    start = filament = 0
    for c, s in shapes:
        node = torch.arange(start, start + (c + 1) * (s + 1)).reshape(c + 1, s + 1)
        start += node.numel()
        first += [node[:-1, :-1].flatten(), node[:-1].flatten()]
        last += [node[:-1, 1:].flatten(), node[1:].flatten()]
        shedding.append(node[-1])
        corners.append(
            torch.stack([part.flatten() for part in (node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:])])
        )
        behind += [node[1:].flatten(), node[-1]]
        bound.append(torch.arange(filament, filament + c * s))
        filament += c * (2 * s + 1)
    joined = (torch.cat(part, dim=-1) for part in (first, last, shedding, corners, behind, bound))
    leg, panel, finite = (
        torch.arange(len(shapes)).repeat_interleave(torch.tensor(sizes))
        for sizes in (
            [s + 1 for _, s in shapes],
            [c * s for c, s in shapes],
            [c * (2 * s + 1) for c, s in shapes],
        )
    )
    return Lattice(shapes, *joined, leg[:, None] != panel, leg[:, None] != finite)
