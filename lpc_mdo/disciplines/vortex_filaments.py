"""Straight vortex filaments as lines: what a lattice of them induces, solved for flow tangency, with its own gradient.

A filament of unit circulation from a to b induces at p, with d1 = |p - a|, d2 = |p - b|, l = b - a and s = d1 + d2,
    V = K (p - a) x (p - b)/(4 pi),  K = (d1 + d2)/(d1 d2 (d1 d2 + (p - a).(p - b))) = 2 s/(d1 d2 (s^2 - |l|^2)),
and (p - a) x (p - b) = a x b - p x l: the scalar K depends on distances alone, all vectors enter as the six Pluecker
coordinates (a x b, l) of the filament's line. A leg from a to infinity along the unit vector u is the limit (a x u, u) with
K = 1/(d1 (d1 - u.(p - a))), and with a core of radius r it is K = 1/(d1 (d1 - u.(p - a)) + r^2/2), which far downstream turns
with the speed h/(h^2 + r^2) Gamma/(2 pi) at the distance h (Scully's vortex). The component along n at p is then K times the product of (a x b, l) with (n, p x n), the screw
of the line through p along n, so that influence matrices are matrix products and a few element-wise operations on distances.

Source of the law: Katz and Plotkin, Low-Speed Aerodynamics (2001), section 10.4.5.

More than 300 lines because the pass back repeats the pass forward step by step: one cannot be read without the other.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor

from lpc_mdo.disciplines.vortex_topology import Lattice
from lpc_mdo.numerics.duplicates import DistinctRows, distinct_rows

FOUR_PI = 4.0 * math.pi
CHUNK = 131072  # pairs of filament and point handled at once: temporaries stay in the cache
LEAST_POINTS = 8  # handled at once however large the batch
KEPT_PAIRS = 1 << 21  # up to so many a pass back finds the distances of the pass forward; beyond, memory is worth more


class Filaments(NamedTuple):
    """Geometry of a lattice's filaments; gradients with respect to the five are added up as the same tuple."""

    nodes: Tensor  # (..., node, 3) m
    lines: Tensor  # (..., filament, 6) Pluecker coordinates over 4 pi, twice those for finite filaments
    squared_length: Tensor  # (..., finite) m^2
    wake: Tensor  # (..., 3) unit vector
    core: Tensor  # (..., leg) half the square of each leg's core radius at points on other surfaces, m^2


class Tangency(NamedTuple):
    """Where flow tangency is asked for, once and at the points' mirror images if there is an image (image = 1 or 2)."""

    points: Tensor  # (..., image, panel, 3) m
    screws: Tensor  # (..., image, panel, 6) (n, p x n)
    inflow: Tensor  # (..., panel) normal velocity that the rings must induce, m/s


def filaments_of(lattice: Lattice, nodes: Tensor, wake: Tensor, wake_core: float) -> Filaments:
    """Filaments between ring corners (..., node, 3) m, trailing along the unit vector `wake` (..., 3).

    wake_core: core radius of the trailing legs on other surfaces, over the mean width of the strips beside the leg.
    """
    first, last = nodes.index_select(-2, lattice.first), nodes.index_select(-2, lattice.last)
    edge, along = nodes.index_select(-2, lattice.shedding), wake[..., None, :]
    length = last - first
    finite = torch.cat([torch.linalg.cross(first, last), length], dim=-1)
    leg = torch.cat([torch.linalg.cross(edge, along.expand_as(edge)), along.expand_as(edge)], dim=-1)
    core = 0.5 * (wake_core * lattice.widths(edge)) ** 2
    return Filaments(nodes, torch.cat([2.0 * finite, leg], dim=-2) / FOUR_PI, (length * length).sum(-1), wake, core)


def solve_rings(lattice: Lattice, filaments: Filaments, tangency: Tangency, points: Tensor) -> tuple[Tensor, Tensor]:
    """Circulation (..., panel) m^2/s that meets the tangency, and the lines' sum (..., image, point, 6) at `points`.

    points (..., image, point, 3) m, one for each panel or for each finite filament, on whose surface it lies. The velocity at p is then sum[:3] - p x sum[3:]. One factorization serves value and
    gradient; further derivatives go through the same formulas by automatic differentiation. Leading dimensions are equal.
    Raises torch.linalg.LinAlgError if surfaces coincide.
    """
    found: tuple[Tensor, Tensor] = _RingSolution.apply(lattice, *filaments, *tangency, points)  # type: ignore[no-untyped-call]  # torch leaves it without annotations
    return found


class _Kernel(NamedTuple):
    """Distances of filaments to points, (..., filament or node, point), and K of finite filaments (half of it) and of legs."""

    distance: Tensor
    total: Tensor
    excess: Tensor
    edge: Tensor
    behind: Tensor
    edge_behind: Tensor  # 1/K of the legs
    value: Tensor


def _distances(nodes: Tensor, points: Tensor) -> Tensor:
    if torch.is_grad_enabled():  # cdist is a single kernel, but only once differentiable
        found: Tensor = torch.linalg.vector_norm(nodes[..., :, None, :] - points[..., None, :, :], dim=-1)
        return found
    return torch.cdist(nodes, points, compute_mode="donot_use_mm_for_euclid_dist")


def _kernel(lattice: Lattice, filaments: Filaments, points: Tensor, apart: Tensor) -> _Kernel:
    """K of every filament at points (..., point, 3); next to nothing on the filament's own line if that has no core.

    apart (leg, point): whether the leg trails from another surface than the point's and so has its core.
    """
    limits = torch.finfo(points.dtype)
    on_line, vast = 0.1 * limits.eps**0.5, limits.max**0.5
    distance = _distances(filaments.nodes, points)
    first, last = distance.index_select(-2, lattice.first), distance.index_select(-2, lattice.last)
    total, squared_length = first + last, filaments.squared_length[..., None]
    excess = torch.addcmul(-squared_length, total, total)
    excess = torch.where(excess > on_line * squared_length, excess, vast)
    edge = distance.index_select(-2, lattice.shedding)
    wake = filaments.wake[..., None]
    edge_along = filaments.nodes.index_select(-2, lattice.shedding) @ wake
    behind = edge + edge_along - (points @ wake).mT
    behind = torch.where(apart | (behind > on_line * edge), behind, vast)
    edge_behind = torch.addcmul(filaments.core[..., None] * apart, edge, behind)
    value = torch.cat([total / (first * last * excess), edge_behind.reciprocal()], dim=-2)
    return _Kernel(distance, total, excess, edge, behind, edge_behind, value)


def _apart(lattice: Lattice, points: Tensor, part: slice) -> Tensor:
    """(leg, image x point) whether legs and the points (..., image, point, 3) of `part` are on different surfaces."""
    images, count = points.shape[-3:-1]
    apart = lattice.panels_apart if count == lattice.panels_apart.shape[-1] else lattice.finite_apart
    return apart[:, part].repeat(1, images)


def _chunks(lattice: Lattice, points: Tensor) -> Iterator[slice]:
    """Slices of the points (..., image, point, 3) that are handled at once."""
    per_point = max(1, points[..., :1, 0].numel()) * (len(lattice.first) + len(lattice.shedding))
    size = max(LEAST_POINTS, CHUNK // per_point)
    count = points.shape[-2]
    yield from (slice(start, min(start + size, count)) for start in range(0, count, size))


def _kernels_at(lattice: Lattice, filaments: Filaments, points: Tensor, part: slice) -> _Kernel:
    """Of the points (..., image, point, 3) those of `part`, images one after the other."""
    return _kernel(lattice, filaments, points[..., part, :].flatten(-3, -2), _apart(lattice, points, part))


def _system(lattice: Lattice, filaments: Filaments, kernel: _Kernel, screws: Tensor) -> Tensor:
    """Normal velocity (..., panel, point) of unit rings at the kernel's points: some columns of the transposed system."""
    images, count = screws.shape[-3:-1]
    rings = lattice.rings(kernel.value * (filaments.lines @ screws.flatten(-3, -2).mT))
    return rings.unflatten(-1, (images, count)).sum(-2) if images > 1 else rings


def _sums(filaments: Filaments, strengths: Tensor, kernel: _Kernel, shape: tuple[int, ...]) -> Tensor:
    """Lines summed by K and strength (..., image, point, 6) at the kernel's points; shape (image, point)."""
    found: Tensor = (kernel.value.mT @ (filaments.lines * strengths[..., None])).unflatten(-2, shape)
    return found


def _differentiable(
    lattice: Lattice, filaments: Filaments, tangency: Tangency, points: Tensor
) -> tuple[Tensor, Tensor]:
    """As `solve_rings`, by automatic differentiation throughout, everything in memory at once."""
    kernel = _kernels_at(lattice, filaments, tangency.points, slice(None))
    circulation = torch.linalg.solve(_system(lattice, filaments, kernel, tangency.screws).mT, tangency.inflow)
    kernel = _kernels_at(lattice, filaments, points, slice(None))
    return circulation, _sums(filaments, lattice.strengths(circulation), kernel, points.shape[-3:-1])


class _Kept(NamedTuple):
    """Distances of a pass forward: slices of the points, and the kernels there of the distinct members of the batch."""

    parts: list[slice]
    kernels: list[_Kernel]
    distinct: DistinctRows

    def kernel(self, i: int) -> _Kernel:
        """Of every member (member, ..., point) at the points of part i."""
        return _Kernel(*(self.distinct.spread(value) for value in self.kernels[i]))


class _RingSolution(torch.autograd.Function):
    """Equal members of a batch are solved once: of the designs that differ in one variable most have the same wing."""

    @staticmethod
    def forward(ctx: Any, lattice: Lattice, *tensors: Tensor) -> tuple[Tensor, Tensor]:
        members = _flat(tensors, tensors[7].shape[:-1])
        is_kept, distinct = _is_kept(ctx, lattice, members), distinct_rows(*members)
        own = [distinct.of(member) for member in members]
        filaments, tangency, points = Filaments(*own[:5]), Tangency(*own[5:8]), own[8]
        at_control, at_points = _Kept([], [], distinct), _Kept([], [], distinct)
        transposed = tangency.inflow.new_empty(*tangency.inflow.shape, tangency.inflow.shape[-1])
        for part in _chunks(lattice, tangency.points):
            kernel = _kernels_at(lattice, filaments, tangency.points, part)
            transposed[..., part] = _system(lattice, filaments, kernel, tangency.screws[..., part, :])
            if is_kept:
                at_control.parts.append(part)
                at_control.kernels.append(kernel)
        factors, pivots = torch.linalg.lu_factor(transposed.mT)
        circulation = torch.linalg.lu_solve(factors, pivots, tangency.inflow[..., None])[..., 0]
        strengths = lattice.strengths(circulation)
        by_part = []
        for part in _chunks(lattice, points):
            kernel = _kernels_at(lattice, filaments, points, part)
            by_part.append(_sums(filaments, strengths, kernel, points[..., part, :].shape[-3:-1]))
            if is_kept:
                at_points.parts.append(part)
                at_points.kernels.append(kernel)
        found = circulation, torch.cat(by_part, dim=-2), strengths, factors, pivots
        circulation, sums, strengths, factors, pivots = (distinct.spread(value) for value in found)
        ctx.save_for_backward(*tensors, strengths)
        ctx.lattice, ctx.factors, ctx.pivots = lattice, factors, pivots
        ctx.kept = (at_control, at_points) if is_kept else (None, None)
        batch = tensors[7].shape[:-1]
        return circulation.reshape(tensors[7].shape), sums.reshape(*batch, *sums.shape[1:])

    @staticmethod
    def backward(ctx: Any, by_circulation: Tensor, by_sums: Tensor) -> tuple[Tensor | None, ...]:
        *tensors, strengths = ctx.saved_tensors
        if torch.is_grad_enabled():
            # Lines depend on nodes and screws on points: views keep the partial derivatives apart.
            tensors = [tensor.view_as(tensor) for tensor in tensors]
            filaments, tangency, points = Filaments(*tensors[:5]), Tangency(*tensors[5:8]), tensors[8]
            outputs = _differentiable(ctx.lattice, filaments, tangency, points)
            needed = [tensor for tensor, is_needed in zip(tensors, ctx.needs_input_grad[1:], strict=True) if is_needed]
            found = iter(torch.autograd.grad(outputs, needed, (by_circulation, by_sums), create_graph=True))
            return None, *(next(found) if is_needed else None for is_needed in ctx.needs_input_grad[1:])
        members = _flat((*tensors, by_circulation, by_sums), by_circulation.shape[:-1])
        filaments, tangency, points = Filaments(*members[:5]), Tangency(*members[5:8]), members[8]
        control_kept, points_kept = ctx.kept
        at_points = _pull_back(ctx.lattice, filaments, strengths, points, members[10], points_kept)
        total = members[9] + ctx.lattice.rings(at_points.strengths[..., None])[..., 0]
        adjoint = torch.linalg.lu_solve(ctx.factors, ctx.pivots, total[..., None], adjoint=True)[..., 0]
        weights = -adjoint[..., None, :, None] * tangency.screws
        at_control = _pull_back(ctx.lattice, filaments, strengths, tangency.points, weights, control_kept)
        by_filaments = [one + other for one, other in zip(at_points.filaments, at_control.filaments, strict=True)]
        by_screws = -adjoint[..., None, :, None] * at_control.sums
        gradients = (*by_filaments, at_control.points, by_screws, adjoint, at_points.points)
        return None, *(gradient.reshape(tensor.shape) for gradient, tensor in zip(gradients, tensors, strict=True))


def _flat(tensors: tuple[Tensor, ...], batch: torch.Size) -> list[Tensor]:
    """The same with one leading dimension in place of those of the batch."""
    return [tensor.reshape(batch.numel(), *tensor.shape[len(batch) :]) for tensor in tensors]


def _is_kept(ctx: Any, lattice: Lattice, members: list[Tensor]) -> bool:
    """Whether a pass back follows and may find the distances: of all members, since it needs them member by member."""
    points = members[5][..., 0].numel() + members[8][..., 0].numel()
    pairs = points * (len(lattice.first) + len(lattice.shedding))
    return any(ctx.needs_input_grad) and pairs <= KEPT_PAIRS


class _PullBack(NamedTuple):
    """Gradient of sum(weights x sums) with respect to strengths, filaments and points, and the sums themselves."""

    strengths: Tensor
    filaments: Filaments
    points: Tensor
    sums: Tensor


def _pull_back(
    lattice: Lattice,
    filaments: Filaments,
    strengths: Tensor,
    points: Tensor,
    weights: Tensor,
    kept: _Kept | None,
) -> _PullBack:
    """Reverse of `_sums` at points (..., image, point, 3) for weights (..., image, point, 6), chunk by chunk.

    kept: the distances, where they are not to be found anew.
    """
    by_strengths = torch.zeros_like(strengths)
    totals = Filaments(*(torch.zeros_like(part) for part in filaments))
    by_points, sums = [], []
    for i, part in enumerate(_chunks(lattice, points) if kept is None else kept.parts):
        shape = points[..., part, :].shape[-3:-1]
        at, weight = (values[..., part, :].flatten(-3, -2) for values in (points, weights))
        apart = _apart(lattice, points, part)
        kernel = _kernel(lattice, filaments, at, apart) if kept is None else kept.kernel(i)
        share = kernel.value * (filaments.lines @ weight.mT)
        by_strengths += share.sum(-1)
        part_filaments, part_points, part_sums = _pull_back_part(
            lattice, filaments, strengths[..., None], at, apart, weight, kernel, share * strengths[..., None]
        )
        for total, addition in zip(totals, part_filaments, strict=True):
            total += addition
        by_points.append(part_points.unflatten(-2, shape))
        sums.append(part_sums.unflatten(-2, shape))
    return _PullBack(by_strengths, totals, torch.cat(by_points, dim=-2), torch.cat(sums, dim=-2))


def _pull_back_part(
    lattice: Lattice,
    filaments: Filaments,
    strengths: Tensor,
    points: Tensor,
    apart: Tensor,
    weights: Tensor,
    kernel: _Kernel,
    share: Tensor,
) -> tuple[Filaments, Tensor, Tensor]:
    """Gradients of one chunk, and its sums; share (..., filament, point) = K x strength x (line . weight).

    d log K = (1/s - 2 s/(s^2 - l^2)) ds - dd1/d1 - dd2/d2 + dl^2/(s^2 - l^2), and for a leg, with q = d1 - u.(p - a),
    d log K = -K (q dd1 + d1 dq + d(r^2/2)), where K q = 1/d1 - K r^2/(2 d1).
    """
    nodes, lines, _, wake, core = filaments
    count = len(lattice.first)
    over_excess = share[..., :count, :] / kernel.excess
    by_core = share[..., count:, :] / kernel.edge_behind
    over_behind = by_core * kernel.edge
    by_core = by_core * apart
    by_total = torch.addcmul(share[..., :count, :] / kernel.total, kernel.total, over_excess, value=-2.0)
    by_distance = lattice.at_nodes(torch.cat([by_total, by_core * core[..., None] / kernel.edge - over_behind], dim=-2))
    pull = (by_distance - lattice.at_nodes(share) / kernel.distance) / kernel.distance
    leg, leg_at_points = over_behind.sum(-1), over_behind.sum(-2)
    edge = nodes.index_select(-2, lattice.shedding)
    by_nodes = nodes * pull.sum(-1)[..., None] - pull @ points
    by_nodes.index_add_(-2, lattice.shedding, -leg[..., None] * wake[..., None, :])
    by_points = points * pull.sum(-2)[..., None] - pull.mT @ nodes + leg_at_points[..., None] * wake[..., None, :]
    by_wake = (leg_at_points[..., None] * points).sum(-2) - (leg[..., None] * edge).sum(-2)
    by_lines = strengths * (kernel.value @ weights)
    return (
        Filaments(by_nodes, by_lines, over_excess.sum(-1), by_wake, -by_core.sum(-1)),
        by_points,
        kernel.value.mT @ (strengths * lines),
    )
