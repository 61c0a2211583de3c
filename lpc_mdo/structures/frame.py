"""Linear statics of three-dimensional frames of Timoshenko beams, batched over frames and load cases.

Freedoms of a node: ux, uy, uz, rx, ry, rz in global axes. Local axes of an element: x from its first to its second node,
y = up x x, z = x x y. Source: Przemieniecki, Theory of Matrix Structural Analysis (1968), chapter 5.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import torch
from torch import Tensor

# Places of the twelve freedoms (u v w rx ry rz at each end) in the four uncoupled parts of the element.
AXIAL, TWIST = (0, 6), (3, 9)
BENDING_XY = (1, 5, 7, 11)  # v, rz
BENDING_XZ = (2, 4, 8, 10)  # w, ry: couplings change sign

SMALLEST_PIVOT = 1e-12  # of the diagonal; a cantilever of a hundred elements keeps 1e-7


@dataclass(frozen=True)
class Topology:
    """What does not vary within a batch: elements (element, 2) node numbers; up (element, 3) any direction that is not
    along the element; is_fixed (node, 6) bool."""

    elements: Tensor
    up: Tensor
    is_fixed: Tensor

    @cached_property
    def freedoms(self) -> Tensor:
        """(element, 12) global freedom numbers."""
        return (6 * self.elements[..., None] + torch.arange(6)).flatten(-2)

    @cached_property
    def free(self) -> Tensor:
        return torch.nonzero(~self.is_fixed.flatten()).squeeze(-1)

    @property
    def nodes(self) -> int:
        return len(self.is_fixed)


@dataclass(frozen=True)
class BeamSections:
    """Section constants, each (..., element): m^2 and m^4.

    second_moment_z: bending in the local x-y plane, with shear_area_y; second_moment_y: in x-z, with shear_area_z.
    An infinite shear area gives the Euler-Bernoulli beam.
    """

    area: Tensor
    second_moment_y: Tensor
    second_moment_z: Tensor
    torsion_constant: Tensor
    shear_area_y: Tensor
    shear_area_z: Tensor


@dataclass(frozen=True)
class FrameSolution:
    """displacement (..., case, node, 6) m, rad; end_forces (..., case, element, 12) N, N m: what the nodes exert on the
    element, in its own axes; reactions (..., case, node, 6) N, N m: what the supports exert on the frame."""

    displacement: Tensor
    end_forces: Tensor
    reactions: Tensor

    @property
    def at_ends(self) -> Tensor:
        """End forces (..., case, element, 2, 6): N, Vy, Vz, T, My, Mz."""
        return self.end_forces.unflatten(-1, (2, 6))


def element_axes(points: Tensor, topology: Topology) -> tuple[Tensor, Tensor]:
    """Lengths (..., element) m and rotations (..., element, 3, 3) whose rows are the local axes."""
    span = points[..., topology.elements[:, 1], :] - points[..., topology.elements[:, 0], :]
    length = torch.linalg.vector_norm(span, dim=-1)
    x = span / length[..., None]
    y = torch.linalg.cross(topology.up.expand_as(x), x, dim=-1)
    y = y / torch.linalg.vector_norm(y, dim=-1, keepdim=True)
    return length, torch.stack([x, y, torch.linalg.cross(x, y, dim=-1)], dim=-2)


def _bending(rigidity: Tensor, shear_rigidity: Tensor, length: Tensor, sign: float) -> Tensor:
    """(..., 4, 4) for deflection and rotation at both ends."""
    flexibility = 12.0 * rigidity / (shear_rigidity * length**2)
    base = rigidity / (length * (1.0 + flexibility))
    a, b = 12.0 * base / length**2, sign * 6.0 * base / length
    c, d = (4.0 + flexibility) * base, (2.0 - flexibility) * base
    rows = [a, b, -a, b, b, c, -b, d, -a, -b, a, -b, b, d, -b, c]
    return torch.stack(torch.broadcast_tensors(*rows), dim=-1).unflatten(-1, (4, 4))


def local_stiffness(sections: BeamSections, length: Tensor, elastic_modulus: float, shear_modulus: float) -> Tensor:
    """(..., element, 12, 12) in local axes: N/m, N, N m."""
    e, g = elastic_modulus, shear_modulus
    pair = torch.tensor([[1.0, -1.0], [-1.0, 1.0]], dtype=length.dtype)
    parts = (
        (AXIAL, (e * sections.area / length)[..., None, None] * pair),
        (TWIST, (g * sections.torsion_constant / length)[..., None, None] * pair),
        (BENDING_XY, _bending(e * sections.second_moment_z, g * sections.shear_area_y, length, 1.0)),
        (BENDING_XZ, _bending(e * sections.second_moment_y, g * sections.shear_area_z, length, -1.0)),
    )
    total = torch.zeros((), dtype=length.dtype)
    for places, block in parts:
        choose = torch.nn.functional.one_hot(torch.tensor(places), 12).to(length.dtype)
        total = total + choose.T @ block @ choose
    return total


def element_turns(rotation: Tensor) -> Tensor:
    """(..., element, 12, 12): both ends' displacements and rotations from global to local axes."""
    blocks = rotation[..., None, :, None, :] * torch.eye(4, dtype=rotation.dtype)[:, None, :, None]
    return blocks.flatten(-4, -3).flatten(-2)


def _assemble(local: Tensor, turns: Tensor, topology: Topology) -> Tensor:
    """Stiffness (..., 6 nodes, 6 nodes) of the whole frame."""
    size = 6 * topology.nodes
    blocks = turns.transpose(-1, -2) @ local @ turns
    place = size * topology.freedoms[:, :, None] + topology.freedoms[:, None, :]
    flat = torch.zeros(*blocks.shape[:-3], size * size, dtype=blocks.dtype)
    return flat.index_add(-1, place.flatten(), blocks.flatten(-3)).unflatten(-1, (size, size))


def internal_forces(displacement: Tensor, local: Tensor, turns: Tensor, topology: Topology) -> tuple[Tensor, Tensor]:
    """End forces (..., case, element, 12) in local axes, and their sums at the nodes (..., case, 6 nodes)."""
    # Load cases are columns, so that the matrices of an element are not repeated for each.
    columns = displacement[..., topology.freedoms].movedim(-3, -1)
    ends = local @ (turns @ columns)
    turned = (turns.transpose(-1, -2) @ ends).movedim(-1, -3).flatten(-2)
    total = torch.zeros(*turned.shape[:-1], 6 * topology.nodes, dtype=turned.dtype)
    return ends.movedim(-1, -3), total.index_add(-1, topology.freedoms.flatten(), turned)


def solve_frame(
    points: Tensor,
    topology: Topology,
    sections: BeamSections,
    loads: Tensor,
    elastic_modulus: float,
    shear_modulus: float,
) -> FrameSolution:
    """Displacements and forces of frames with points (..., node, 3) m under nodal loads (..., case, node, 6) N, N m.

    Exact at the nodes for loads at nodes. One Cholesky factor serves all load cases; a step of iterative refinement with
    it carries the derivatives, so that first derivatives in either mode are exact at the price of one more solve; second
    derivatives are not. Raises ValueError if the supports leave a mechanism.
    """
    length, rotation = element_axes(points, topology)
    local, turns = local_stiffness(sections, length, elastic_modulus, shear_modulus), element_turns(rotation)
    with torch.no_grad():
        stiffness = _assemble(local.detach(), turns.detach(), topology)
        free = stiffness[..., topology.free[:, None], topology.free]
        factor, info = torch.linalg.cholesky_ex(free)
        # What is left of each diagonal entry by elimination: nothing but rounding where a part can move freely.
        left = factor.diagonal(dim1=-2, dim2=-1) ** 2 / free.diagonal(dim1=-2, dim2=-1)
        if bool((info != 0).any()) or not bool((left >= SMALLEST_PIVOT).all()):
            raise ValueError("supports are not allowed; they leave the frame or a part of it free to move")
    external = loads.flatten(-2)

    def solved(force: Tensor) -> Tensor:
        """Displacements (..., case, 6 nodes), zero at the supports."""
        answer = torch.cholesky_solve(force[..., topology.free].transpose(-1, -2), factor).transpose(-1, -2)
        whole = torch.zeros(*answer.shape[:-1], 6 * topology.nodes, dtype=answer.dtype)
        return whole.index_copy(-1, topology.free, answer)

    first = solved(external.detach())
    _, internal = internal_forces(first, local, turns, topology)
    displacement = first + solved(external - internal)
    ends, internal = internal_forces(displacement, local, turns, topology)
    supported = (internal - external) * topology.is_fixed.flatten().to(internal.dtype)
    shape = (topology.nodes, 6)
    return FrameSolution(displacement.unflatten(-1, shape), ends, supported.unflatten(-1, shape))


def subdivide(points: Tensor, segments: Tensor, parts: int | Sequence[int]) -> tuple[Tensor, Tensor]:
    """Points (..., node, 3) and elements (element, 2) with every segment (segment, 2) cut into equal parts.

    The given points keep their numbers.
    """
    counts = [parts] * len(segments) if isinstance(parts, int) else parts
    count, elements, added = points.shape[-2], [], []
    for (start, end), pieces in zip(segments.tolist(), counts, strict=True):
        chain = [start]
        for k in range(1, pieces):
            added.append(points[..., start, :] + (k / pieces) * (points[..., end, :] - points[..., start, :]))
            chain.append(count + len(added) - 1)
        chain.append(end)
        elements += list(pairwise(chain))
    extra = [torch.stack(added, dim=-2)] if added else []
    return torch.cat([points, *extra], dim=-2), torch.tensor(elements)
