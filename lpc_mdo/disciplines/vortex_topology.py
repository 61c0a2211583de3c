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
    panels_apart: Tensor  # (leg, panel) whether the leg has a core on the panel, which then is on another surface
    finite_apart: Tensor  # (leg, finite) the same on the finite filament
    port: Tensor  # (strip,) leg at its port end
    between: Tensor  # (strip, leg) from legs to the vectors across the strips
    beside: Tensor  # (strip, leg) mean of the strips on either side of a leg
    in_strip: Tensor  # (strip, panel) 1 where the panel lies in the strip
    quarter_chord: Tensor  # (strip, node) from nodes to the vectors across the strips on the quarter-chord line
    growth: Tensor  # (strip, strip) sixteenth of the difference of the neighbours' widths, port less starboard
    strips_apart: (
        Tensor  # (panel, panel) whether the panels' strips do not adjoin: on other surfaces, or beyond the next
    )
    image_apart: Tensor  # (panel, panel) the same for the mirror images of starboard halves and the panels

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
        """Mean width (..., leg) m of the strips on either side of each leg, for legs that trail from edges (..., leg, n) m."""
        found: Tensor = torch.linalg.vector_norm(self.between.to(edges) @ edges, dim=-1) @ self.beside.to(edges)
        return found

    def collocation(self, strips: Tensor) -> Tensor:
        """Where the flow is met in each strip (..., strip), as a share of its width from port.

        strips (..., strip, n) m: vectors across the strips, without their part along the stream. The point lies half way in the parameter that spaces the
        mesh, found from the neighbours' widths by interpolation of third order: in the middle of equal strips, at the middle
        angle of cosine spacing (but for terms of the order of the angle's square), where lift converges at second order.
        Beside strips more than five times as wide it stays within a quarter of the width from the middle.
        Source of the rule: Lan, A quasi-vortex-lattice method in thin wing theory, J. Aircraft 11 (1974).
        """
        width = torch.linalg.vector_norm(strips, dim=-1)
        shift = (width @ self.growth.to(width)) / torch.where(width > 0.0, width, 1.0)
        found: Tensor = 0.5 + shift.clamp(-0.25, 0.25)
        return found

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
def lattice_of(shapes: tuple[tuple[int, int], ...], has_core: bool = True) -> Lattice:
    """Topology of surfaces with these numbers of panels along chord and span, one after the other.

    has_core: whether legs have a core on other surfaces; else they are treated there as on their own.
    """
    first, last, leading, shedding, corners, behind, bound = [], [], [], [], [], [], []
    start = filament = 0
    for c, s in shapes:
        node = torch.arange(start, start + (c + 1) * (s + 1)).reshape(c + 1, s + 1)
        start += node.numel()
        first += [node[:-1, :-1].flatten(), node[:-1].flatten()]
        last += [node[:-1, 1:].flatten(), node[1:].flatten()]
        leading.append(node[0])
        shedding.append(node[-1])
        corners.append(
            torch.stack([part.flatten() for part in (node[:-1, :-1], node[:-1, 1:], node[1:, :-1], node[1:, 1:])])
        )
        behind += [node[1:].flatten(), node[-1]]
        bound.append(torch.arange(filament, filament + c * s))
        filament += c * (2 * s + 1)
    leg, panel, finite = (
        torch.arange(len(shapes)).repeat_interleave(torch.tensor(sizes))
        for sizes in (
            [s + 1 for _, s in shapes],
            [c * s for c, s in shapes],
            [c * (2 * s + 1) for c, s in shapes],
        )
    )
    spans = [s for _, s in shapes]
    places = torch.tensor([0, *spans]).cumsum(0)[:-1].tolist()  # of each surface's first strip
    ports = torch.cat([torch.arange(s) + at + k for k, (s, at) in enumerate(zip(spans, places, strict=True))])
    strip = torch.cat([torch.arange(s).repeat(c) for c, s in shapes])
    between = torch.zeros(sum(spans), len(leg), dtype=torch.float64)
    between[torch.arange(sum(spans)), ports] = -1.0
    between[torch.arange(sum(spans)), ports + 1] = 1.0
    beside = between.abs()
    quarter = torch.zeros(sum(spans), start, dtype=torch.float64)
    for share, row in ((0.75, torch.cat(leading)), (0.25, torch.cat(shedding))):
        for sign, end in ((-1.0, ports), (1.0, ports + 1)):
            quarter[torch.arange(sum(spans)), row[end]] += sign * share
    other = panel[:, None] != panel
    # The image's strips count on beyond the root: its first, -1, adjoins strip 0.
    beyond, image_beyond = (strip[:, None] - strip).abs() > 1, strip[:, None] + strip + 1 > 1
    return Lattice(
        shapes=shapes,
        first=torch.cat(first),
        last=torch.cat(last),
        shedding=torch.cat(shedding),
        corners=torch.cat(corners, dim=-1),
        behind=torch.cat(behind),
        bound=torch.cat(bound),
        panels_apart=(leg[:, None] != panel) & has_core,
        finite_apart=(leg[:, None] != finite) & has_core,
        port=ports,
        between=between,
        beside=beside / beside.sum(0),
        in_strip=torch.nn.functional.one_hot(strip + torch.tensor(places)[panel], sum(spans)).T.double().contiguous(),
        quarter_chord=quarter,
        growth=torch.block_diag(*(_growth(s) for s in spans)),
        strips_apart=other | beyond,
        image_apart=other | image_beyond,
    )


def _growth(count: int) -> Tensor:
    """Matrix (strip, strip) from widths to a sixteenth of the neighbours' difference, a missing neighbour extrapolated."""
    matrix = torch.zeros(count, count, dtype=torch.float64)
    for k in range(count if count > 1 else 0):
        for sign, near, far in ((1.0, k - 1, k + 1), (-1.0, k + 1, k - 1)):
            if 0 <= near < count:
                matrix[near, k] += sign / 16.0
            else:
                matrix[k, k] += 2.0 * sign / 16.0
                matrix[far, k] -= sign / 16.0
    return matrix
