"""Steady vortex-lattice method for any number of lifting surfaces and flight conditions in one batch.

Vortex rings follow the mean surface, their front legs on the panels' quarter-chord lines, and leave the trailing edge
along the free stream; flow tangency holds at the three-quarter-chord points, forces are Kutta-Joukowski's on the spanwise
segments. Source: Katz and Plotkin, Low-Speed Aerodynamics (2001), chapter 12.

Where codes differ: rings on the surface (as here and in OpenAerostruct) and horseshoes whose legs run straight aft from
inside the surface (as in AeroSandbox) agree for flat wings. For cambered wings and for a tail in the wake they do not
tend to the same limit; rings are the better founded choice, since the sheet of a thin wing lies on its mean surface and a
free wake carries no force only if it follows the stream.

Axes x aft, y starboard, z up.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

FOUR_PI = 4.0 * math.pi
ON_LINE = 1e-10  # a segment induces nothing at points closer to its line than about this angle


@dataclass(frozen=True)
class LatticeLoads:
    """Loads of the whole aircraft, near field."""

    force: Tensor  # (..., 3) N
    moment: Tensor  # (..., 3) N m about the reference point, right-handed in the geometry axes
    lift: Tensor  # (...,) N normal to the stream, in the plane of symmetry
    side_force: Tensor  # (...,) N to starboard
    induced_drag: Tensor  # (...,) N along the stream
    surface_force: tuple[Tensor, ...]  # (..., 3) N of each mesh
    panel_force: tuple[Tensor, ...]  # (..., chordwise, spanwise, 3) N on the panels given
    circulation: tuple[Tensor, ...]  # (..., spanwise) m^2/s, shed at the trailing edge


@dataclass(frozen=True)
class _Lattice:
    """One surface: ring corners (..., c + 1, s + 1, 3), control points and normals (..., panel, 3)."""

    corners: Tensor
    control: Tensor
    normal: Tensor

    @property
    def shape(self) -> tuple[int, int]:
        return self.corners.shape[-3] - 1, self.corners.shape[-2] - 1

    @property
    def bound(self) -> Tensor:
        """Spanwise vectors (..., panel, 3) of the front legs."""
        front = self.corners[..., :-1, :, :]
        return (front[..., 1:, :] - front[..., :-1, :]).flatten(-3, -2)

    @property
    def bound_middle(self) -> Tensor:
        front = self.corners[..., :-1, :, :]
        return (0.5 * (front[..., 1:, :] + front[..., :-1, :])).flatten(-3, -2)


def _lattice(mesh: Tensor) -> _Lattice:
    quarter = 0.75 * mesh[..., :-1, :, :] + 0.25 * mesh[..., 1:, :, :]
    corners = torch.cat([quarter, mesh[..., -1:, :, :]], dim=-3)
    three_quarter = 0.25 * mesh[..., :-1, :, :] + 0.75 * mesh[..., 1:, :, :]
    control = 0.5 * (three_quarter[..., 1:, :] + three_quarter[..., :-1, :])
    first = mesh[..., 1:, 1:, :] - mesh[..., :-1, :-1, :]
    second = mesh[..., :-1, 1:, :] - mesh[..., 1:, :-1, :]
    normal = torch.linalg.cross(first, second)
    normal = normal / torch.linalg.vector_norm(normal, dim=-1, keepdim=True)
    return _Lattice(corners, control.flatten(-3, -2), normal.flatten(-3, -2))


def _segment_velocity(first: Tensor, second: Tensor, first_length: Tensor, second_length: Tensor) -> Tensor:
    """4 pi times the velocity (..., 3) of unit segments whose ends are at minus `first` and `second` (..., 3).

    V = (r1 x r2)(|r1| + |r2|)/(|r1||r2|(|r1||r2| + r1.r2)), zero on the segment itself.
    """
    lengths = first_length * second_length
    closeness = lengths + (first * second).sum(-1)
    is_off = closeness > ON_LINE * lengths
    factor = torch.where(is_off, first_length + second_length, 0.0) / (lengths * torch.where(is_off, closeness, 1.0))
    return torch.linalg.cross(first, second) * factor[..., None]


def _ring_velocity(lattice: _Lattice, points: Tensor, wake: Tensor) -> Tensor:
    """Velocity (..., point, panel, 3) at points (..., point, 3) of rings of unit circulation; wake (..., 3) unit vector.

    Each leg is evaluated once and shared by its neighbours.
    """
    arm = points[..., :, None, None, :] - lattice.corners[..., None, :, :, :]
    length = torch.linalg.vector_norm(arm, dim=-1)
    spanwise = _segment_velocity(arm[..., :-1, :], arm[..., 1:, :], length[..., :-1], length[..., 1:])
    chordwise = _segment_velocity(arm[..., :-1, :, :], arm[..., 1:, :, :], length[..., :-1, :], length[..., 1:, :])
    edge, edge_length = arm[..., -1, :, :], length[..., -1, :]
    along = wake[..., None, None, :]
    leg = torch.linalg.cross(along.expand_as(edge), edge) / (
        edge_length * (edge_length - (edge * along).sum(-1)) + 1e-14
    ).unsqueeze(-1)
    rings = spanwise[..., :-1, :, :] + chordwise[..., 1:, :] - chordwise[..., :-1, :]
    rear = torch.cat([-spanwise[..., 1:-1, :, :], (leg[..., 1:, :] - leg[..., :-1, :])[..., None, :, :]], dim=-3)
    return (rings + rear).flatten(-3, -2) / FOUR_PI


def vortex_lattice(
    meshes: Sequence[Tensor],
    velocity: Tensor,
    density: Tensor,
    reference_point: Tensor,
    *,
    is_symmetric: bool = False,
    turn_rate: Tensor | None = None,
    mach: Tensor | None = None,
) -> LatticeLoads:
    """Loads on lifting surfaces in steady flight.

    meshes: per surface the corners (..., chordwise + 1, spanwise + 1, 3) m of its panels on the mean surface, leading edge
    and smallest y first; with `is_symmetric` only the starboard half (y >= 0), whose mirror image is added. velocity
    (..., 3) m/s is the air's relative to the aircraft; density (...,) kg/m^3; reference_point (..., 3) m.
    turn_rate (..., 3) rad/s, right-handed about the axes here: the aircraft turns about the reference point, its wake stays
    straight. mach (...,): Prandtl and Glauert's correction, for slender shapes that hardly disturb the stream.
    Leading dimensions broadcast: conditions may differ in stream, mesh or both. Raises ValueError unless 0 <= mach < 1, and
    for a symmetric half model that rolls or yaws.
    """
    optional = [value.shape[:-1] for value in (turn_rate,) if value is not None]
    optional += [value.shape for value in (mach,) if value is not None]
    batch = torch.broadcast_shapes(
        *(mesh.shape[:-3] for mesh in meshes),
        velocity.shape[:-1],
        density.shape,
        reference_point.shape[:-1],
        *optional,
    )
    velocity = velocity.expand(*batch, 3)
    wake = velocity / torch.linalg.vector_norm(velocity, dim=-1, keepdim=True)
    meshes = [mesh.expand(*batch, *mesh.shape[-3:]) for mesh in meshes]
    lattices = [_lattice(mesh) for mesh in meshes]
    control, middle = _joined(lattices, "control"), _joined(lattices, "bound_middle")
    reference = reference_point[..., None, :]
    at_control = at_bound = velocity[..., None, :]
    if turn_rate is not None:
        if is_symmetric and bool((turn_rate[..., ::2] != 0.0).any()):
            raise ValueError("turn_rate is not allowed to roll or yaw a symmetric half model; give the whole aircraft")
        turn = turn_rate.expand(*batch, 3)[..., None, :]
        at_control, at_bound = (
            velocity[..., None, :] - torch.linalg.cross(*torch.broadcast_tensors(turn, points - reference))
            for points in (control, middle)
        )
    if mach is None:
        circulation, panel_force = _solve(lattices, at_control, at_bound, wake, density, is_symmetric)
    else:
        circulation, panel_force = _solve_compressible(
            meshes, reference[..., None, :], at_control, at_bound, wake, density, is_symmetric, mach.expand(batch)
        )
    panel_moment = torch.linalg.cross(middle - reference, panel_force)
    mirror = _mirror(panel_force)
    both = 1.0 + mirror if is_symmetric else torch.ones_like(mirror)
    both_moment = 1.0 - mirror if is_symmetric else torch.ones_like(mirror)
    forces = _split(panel_force, lattices, -2)
    force = panel_force.sum(-2) * both
    lift, side, drag = _wind_axes(force, wake)
    return LatticeLoads(
        force=force,
        moment=panel_moment.sum(-2) * both_moment,
        lift=lift,
        side_force=side,
        induced_drag=drag,
        surface_force=tuple(part.sum(-2) * both for part in forces),
        panel_force=tuple(part.unflatten(-2, lattice.shape) for part, lattice in zip(forces, lattices, strict=True)),
        circulation=tuple(
            part.unflatten(-1, lattice.shape)[..., -1, :]
            for part, lattice in zip(_split(circulation, lattices, -1), lattices, strict=True)
        ),
    )


def _solve(
    lattices: Sequence[_Lattice],
    at_control: Tensor,
    at_bound: Tensor,
    wake: Tensor,
    density: Tensor,
    is_symmetric: bool,
) -> tuple[Tensor, Tensor]:
    """Circulation of the rings (..., panel) and force (..., panel, 3) in the stream `at_control` and `at_bound` (..., panel, 3)."""
    control, normal, bound, middle = (
        _joined(lattices, name) for name in ("control", "normal", "bound", "bound_middle")
    )
    count = control.shape[-2]
    points = torch.cat([control, middle], dim=-2)
    mirror = _mirror(points)
    if is_symmetric:
        points = torch.cat([points, points * mirror], dim=-2)
    influence = torch.cat([_ring_velocity(lattice, points, wake) for lattice in lattices], dim=-2)
    if is_symmetric:
        # The image's velocity at p is the mirror image of the original's at the mirror image of p.
        own, mirrored = influence.split(2 * count, dim=-3)
        influence = own + mirrored * mirror
    on_control, on_bound = influence.split(count, dim=-3)
    system = (on_control * normal[..., :, None, :]).sum(-1)
    inflow = -(normal * at_control).sum(-1)
    circulation = torch.linalg.solve(system, inflow)
    net = torch.cat(
        [
            _bound_circulation(part, lattice.shape)
            for part, lattice in zip(_split(circulation, lattices, -1), lattices, strict=True)
        ],
        dim=-1,
    )
    local = at_bound + (on_bound * circulation[..., None, :, None]).sum(-2)
    return circulation, torch.linalg.cross(local, bound) * (net * density[..., None])[..., None]


def _solve_compressible(
    meshes: Sequence[Tensor],
    origin: Tensor,
    at_control: Tensor,
    at_bound: Tensor,
    wake: Tensor,
    density: Tensor,
    is_symmetric: bool,
    mach: Tensor,
) -> tuple[Tensor, Tensor]:
    """As `_solve`, by Goethert's rule: the incompressible flow about the shape thinned across the stream by beta.

    Potentials are those of the thin shape over beta^2, forces over beta^3 across the stream and beta^4 along it.
    """
    if bool(((mach < 0.0) | (mach >= 1.0)).any()):
        raise ValueError(f"mach = {float(mach.max()):g} is not allowed; it must lie between 0 and 1")
    beta = torch.sqrt(1.0 - mach**2)[..., None]
    axes = torch.stack(_stream_axes(wake), dim=-2)  # rows: along the stream, across, up
    one = torch.ones_like(beta)
    thinning = torch.cat([one, beta, beta], dim=-1)[..., None, :]
    weakening = (beta**3 * torch.cat([beta, one, one], dim=-1))[..., None, :]

    def to_thin(vectors: Tensor) -> Tensor:
        return (vectors @ axes.mT) * thinning

    thin = [_lattice(to_thin((mesh - origin).flatten(-3, -2)).unflatten(-2, mesh.shape[-3:-1])) for mesh in meshes]
    downstream = torch.tensor([1.0, 0.0, 0.0], dtype=wake.dtype, device=wake.device).expand_as(wake)
    circulation, force = _solve(thin, to_thin(at_control), to_thin(at_bound), downstream, density, is_symmetric)
    return circulation / beta**2, (force / weakening) @ axes


def _joined(lattices: Sequence[_Lattice], name: str) -> Tensor:
    return torch.cat([getattr(lattice, name) for lattice in lattices], dim=-2)


def _mirror(like: Tensor) -> Tensor:
    return torch.tensor([1.0, -1.0, 1.0], dtype=like.dtype, device=like.device)


def _split(values: Tensor, lattices: Sequence[_Lattice], dim: int) -> tuple[Tensor, ...]:
    return values.split([math.prod(lattice.shape) for lattice in lattices], dim=dim)


def _bound_circulation(rings: Tensor, shape: tuple[int, int]) -> Tensor:
    """Net circulation (..., panel) on the front legs: a ring's own less that of the ring ahead."""
    grid = rings.unflatten(-1, shape)
    return torch.cat([grid[..., :1, :], grid[..., 1:, :] - grid[..., :-1, :]], dim=-2).flatten(-2)


def _stream_axes(wake: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Unit vectors (..., 3) along the stream, to starboard and up, for a stream along the unit vector `wake` (..., 3)."""
    starboard = torch.zeros_like(wake)
    starboard[..., 1] = 1.0
    up = torch.linalg.cross(wake, starboard)
    up = up / torch.linalg.vector_norm(up, dim=-1, keepdim=True)
    return wake, torch.linalg.cross(up, wake), up


def _wind_axes(force: Tensor, wake: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Lift, side force and drag (...,) for a stream along the unit vector `wake` (..., 3)."""
    along, side, up = _stream_axes(wake)
    return (force * up).sum(-1), (force * side).sum(-1), (force * along).sum(-1)


def far_field_drag(circulation: Tensor, trailing_edge: Tensor, density: Tensor) -> Tensor:
    """Induced drag (...,) N of one flat-wake surface from its wake, by the Trefftz-plane integral.

    circulation (..., spanwise) m^2/s; trailing_edge (..., spanwise + 1, 3) m of the full span, stream along x.
    D = -rho/2 sum Gamma_i w_i dy_i with w the normalwash at the middle of each strip.
    """
    y, z = trailing_edge[..., 1], trailing_edge[..., 2]
    middle_y, middle_z = 0.5 * (y[..., 1:] + y[..., :-1]), 0.5 * (z[..., 1:] + z[..., :-1])
    dy = middle_y[..., :, None] - y[..., None, :]
    dz = middle_z[..., :, None] - z[..., None, :]
    # Legs shed at the edges of strip j carry -Gamma_j (port end) and +Gamma_j (starboard end) along the stream.
    zero = torch.zeros_like(circulation[..., :1])
    shed = torch.cat([zero, circulation], dim=-1) - torch.cat([circulation, zero], dim=-1)
    squared = dy**2 + dz**2
    upwash = (shed[..., None, :] * dy / (2.0 * math.pi * squared)).sum(-1)
    sidewash = -(shed[..., None, :] * dz / (2.0 * math.pi * squared)).sum(-1)
    normalwash = upwash * (y[..., 1:] - y[..., :-1]) - sidewash * (z[..., 1:] - z[..., :-1])
    return -0.5 * density * (circulation * normalwash).sum(-1)
