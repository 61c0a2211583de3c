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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np  # its broadcast_shapes: PyTorch's would load a symbolic algebra package
import torch
from torch import Tensor

from lpc_mdo.disciplines.vortex_clearance import require_sound_meshes
from lpc_mdo.disciplines.vortex_filaments import Tangency, filaments_of, solve_rings
from lpc_mdo.disciplines.vortex_topology import Lattice, lattice_of


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
class _Panels:
    """Panels of all surfaces, one after the other."""

    rings: Tensor  # (..., node, 3) corners of the rings
    control: Tensor  # (..., panel, 3) where the flow is tangential
    normal: Tensor  # (..., panel, 3)
    first: Tensor  # (..., leg, 3) ends of the legs that carry force: the front legs in the order of the panels, or all
    last: Tensor
    middle: Tensor  # (..., leg, 3) where the velocity that loads them is taken


def _panels(lattice: Lattice, nodes: Tensor, has_chordwise_forces: bool) -> _Panels:
    rings = 0.75 * nodes + 0.25 * nodes.index_select(-2, lattice.behind)
    front_port, front_starboard, rear_port, rear_starboard = (nodes.index_select(-2, part) for part in lattice.corners)
    share = (lattice.collocation(lattice.quarter_chord.to(nodes) @ nodes[..., 1:]) @ lattice.in_strip.to(nodes))[
        ..., None
    ]
    control = torch.lerp(0.25 * front_port + 0.75 * rear_port, 0.25 * front_starboard + 0.75 * rear_starboard, share)
    normal = torch.linalg.cross(rear_starboard - front_port, front_starboard - rear_port)
    normal = normal / torch.linalg.vector_norm(normal, dim=-1, keepdim=True)
    first, last = (rings.index_select(-2, end) for end in lattice.corners[:2])
    middle = torch.lerp(first, last, share)
    if has_chordwise_forces:
        bound = middle
        first, last = (rings.index_select(-2, end) for end in (lattice.first, lattice.last))
        middle = (0.5 * (first + last)).index_copy(-2, lattice.bound, bound)
    return _Panels(rings, control, normal, first, last, middle)


def vortex_lattice(
    meshes: Sequence[Tensor],
    velocity: Tensor,
    density: Tensor,
    reference_point: Tensor,
    *,
    is_symmetric: bool = False,
    turn_rate: Tensor | None = None,
    mach: Tensor | None = None,
    has_chordwise_forces: bool = False,
    wake_direction: Tensor | None = None,
    wake_core: float = 1.0,
    names: Sequence[str] = (),
) -> LatticeLoads:
    """Loads on lifting surfaces in steady flight.

    meshes: per surface the corners (..., chordwise + 1, spanwise + 1, 3) m of its panels on the mean surface, leading edge
    and smallest y first; with `is_symmetric` only the starboard half (y >= 0), whose mirror image is added. velocity
    (..., 3) m/s is the air's relative to the aircraft; density (...,) kg/m^3; reference_point (..., 3) m.
    turn_rate (..., 3) rad/s, right-handed about the axes here: the aircraft turns about the reference point, its wake stays
    straight. mach (...,): Prandtl and Glauert's correction, for slender shapes that hardly disturb the stream.
    has_chordwise_forces: the chordwise legs carry force, too, as any bound vortex does. The drag then tends to the far
    field's, from which it stays some tenths of a per cent away without them (as in OpenAerostruct), and a wing in sideslip
    has the rolling moment of its tips, which without them has the wrong sign.
    wake_direction (..., 3): unit vector along which the wake trails, where it is not to follow the stream.
    wake_core: core radius that the trailing legs of one surface have on all others, over the width of the strips beside the
    leg. A row of such vortices is smooth from a core as wide as their distance on and tends to the sheet with it; without a
    core (0) a tail that crosses the wing's wake meets singular velocities, and a leg exactly through a point induces nothing.
    names: what the surfaces are called in messages; default: meshes.0, meshes.1, ...
    Leading dimensions broadcast: conditions may differ in stream, mesh or both. Raises ValueError unless 0 <= mach < 1 and
    wake_core >= 0 and velocity has a part in the plane of symmetry, for a symmetric half model that rolls or yaws, if a panel is flat or crossed, and if surfaces are closer to
    each other, or to parts of themselves that do not adjoin, than half a panel: see `vortex_clearance`.
    """
    optional = [value.shape[:-1] for value in (turn_rate, wake_direction) if value is not None]
    optional += [value.shape for value in (mach,) if value is not None]
    batch = np.broadcast_shapes(
        *(mesh.shape[:-3] for mesh in meshes),
        velocity.shape[:-1],
        density.shape,
        reference_point.shape[:-1],
        *optional,
    )
    if not wake_core >= 0.0:
        raise ValueError(f"wake_core = {wake_core:g} is not allowed; it must not be negative")
    if bool((velocity[..., ::2] == 0.0).all(-1).any()):
        raise ValueError(
            "velocity is invalid: it must have a part in the plane of symmetry, where lift is normal to it"
        )
    velocity, reference = velocity.expand(*batch, 3), reference_point.expand(*batch, 3)[..., None, :]
    stream = velocity / torch.linalg.vector_norm(velocity, dim=-1, keepdim=True)
    wake = stream if wake_direction is None else wake_direction.expand(*batch, 3)
    shapes = tuple((mesh.shape[-3] - 1, mesh.shape[-2] - 1) for mesh in meshes)
    lattice = lattice_of(shapes, has_core=wake_core > 0.0)
    nodes = torch.cat([mesh.expand(*batch, *mesh.shape[-3:]).flatten(-3, -2) for mesh in meshes], dim=-2) - reference
    require_sound_meshes(lattice, nodes, names or [f"meshes.{k}" for k in range(len(meshes))], is_symmetric)
    panels = _panels(lattice, nodes, has_chordwise_forces)
    middle = panels.middle
    at_control, at_bound = velocity[..., None, :].expand_as(panels.control), velocity[..., None, :].expand_as(middle)
    if turn_rate is not None:
        if is_symmetric and bool((turn_rate[..., ::2] != 0.0).any()):
            raise ValueError("turn_rate is not allowed to roll or yaw a symmetric half model; give the whole aircraft")
        turn = turn_rate.expand(*batch, 3)[..., None, :]
        at_control = at_control - torch.linalg.cross(turn.expand_as(panels.control), panels.control)
        at_bound = at_bound - torch.linalg.cross(turn.expand_as(middle), middle)
    if mach is None:
        circulation, per_density = _solve(lattice, panels, at_control, at_bound, wake, wake_core, is_symmetric)
    else:
        circulation, per_density = _solve_compressible(
            lattice,
            nodes,
            at_control,
            at_bound,
            stream,
            wake,
            wake_core,
            is_symmetric,
            mach.expand(batch),
            has_chordwise_forces,
        )
    leg_force = per_density * density[..., None, None]
    leg_moment = torch.linalg.cross(middle, leg_force)
    panel_force = lattice.on_panels(leg_force) if has_chordwise_forces else leg_force
    mirror = _mirror(panel_force)
    both = 1.0 + mirror if is_symmetric else torch.ones_like(mirror)
    both_moment = 1.0 - mirror if is_symmetric else torch.ones_like(mirror)
    forces = panel_force.split(lattice.panel_sizes, dim=-2)
    force = panel_force.sum(-2) * both
    lift, side, drag = _wind_axes(force, stream)
    return LatticeLoads(
        force=force,
        moment=leg_moment.sum(-2) * both_moment,
        lift=lift,
        side_force=side,
        induced_drag=drag,
        surface_force=tuple(part.sum(-2) * both for part in forces),
        panel_force=tuple(part.unflatten(-2, shape) for part, shape in zip(forces, lattice.shapes, strict=True)),
        circulation=tuple(
            part.unflatten(-1, shape)[..., -1, :]
            for part, shape in zip(circulation.split(lattice.panel_sizes, dim=-1), lattice.shapes, strict=True)
        ),
    )


def _solve(
    lattice: Lattice,
    panels: _Panels,
    at_control: Tensor,
    at_bound: Tensor,
    wake: Tensor,
    wake_core: float,
    is_symmetric: bool,
) -> tuple[Tensor, Tensor]:
    """Circulation of the rings (..., panel) and force over density (..., leg, 3) in the stream at control points and legs."""
    points, normal, middle = (values[..., None, :, :] for values in (panels.control, panels.normal, panels.middle))
    mirror = _mirror(middle)
    if is_symmetric:
        # The image's velocity at p is the mirror image of the original's at the mirror image of p.
        points, normal, middle = (torch.cat([v, v * mirror], dim=-3) for v in (points, normal, middle))
    tangency = Tangency(
        points,
        torch.cat([normal, torch.linalg.cross(points, normal)], dim=-1),
        -(panels.normal * at_control).sum(-1),
    )
    filaments = filaments_of(lattice, panels.rings, wake, wake_core)
    try:
        circulation, sums = solve_rings(lattice, filaments, tangency, middle)
    except torch.linalg.LinAlgError:
        raise ValueError(
            "meshes are invalid: their panels must induce normal velocities that differ from each other"
        ) from None
    induced = sums[..., :3] - torch.linalg.cross(middle, sums[..., 3:])
    local = at_bound + induced[..., 0, :, :]
    if is_symmetric:
        local = local + induced[..., 1, :, :] * mirror
    strengths = lattice.strengths(circulation)[..., : len(lattice.first)]
    if local.shape[-2] != strengths.shape[-1]:
        strengths = strengths.index_select(-1, lattice.bound)
    return circulation, torch.linalg.cross(local, panels.last - panels.first) * strengths[..., None]


def _solve_compressible(
    lattice: Lattice,
    nodes: Tensor,
    at_control: Tensor,
    at_bound: Tensor,
    stream: Tensor,
    wake: Tensor,
    wake_core: float,
    is_symmetric: bool,
    mach: Tensor,
    has_chordwise_forces: bool,
) -> tuple[Tensor, Tensor]:
    """As `_solve`, by Goethert's rule: the incompressible flow about the shape thinned across the stream by beta.

    Potentials are those of the thin shape over beta^2, forces over beta^3 across the stream and beta^4 along it.
    """
    if bool(((mach < 0.0) | (mach >= 1.0)).any()):
        raise ValueError(f"mach = {float(mach.max()):g} is not allowed; it must lie between 0 and 1")
    beta = torch.sqrt(1.0 - mach**2)[..., None]
    axes = torch.stack(stream_axes(stream), dim=-2)  # rows: along the stream, across, up
    one = torch.ones_like(beta)
    thinning = torch.cat([one, beta, beta], dim=-1)[..., None, :]
    weakening = (beta**3 * torch.cat([beta, one, one], dim=-1))[..., None, :]

    def to_thin(vectors: Tensor) -> Tensor:
        return (vectors @ axes.mT) * thinning

    trailing = to_thin(wake[..., None, :])[..., 0, :]
    trailing = trailing / torch.linalg.vector_norm(trailing, dim=-1, keepdim=True)
    thin = _panels(lattice, to_thin(nodes), has_chordwise_forces)
    circulation, force = _solve(
        lattice, thin, to_thin(at_control), to_thin(at_bound), trailing, wake_core, is_symmetric
    )
    return circulation / beta**2, (force / weakening) @ axes


def _mirror(like: Tensor) -> Tensor:
    return torch.tensor([1.0, -1.0, 1.0], dtype=like.dtype, device=like.device)


def stream_axes(stream: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Unit vectors (..., 3) along the stream, to starboard and up, for a stream along the unit vector `stream` (..., 3)."""
    starboard = torch.zeros_like(stream)
    starboard[..., 1] = 1.0
    up = torch.linalg.cross(stream, starboard)
    up = up / torch.linalg.vector_norm(up, dim=-1, keepdim=True)
    return stream, torch.linalg.cross(up, stream), up


def _wind_axes(force: Tensor, stream: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Lift, side force and drag (...,) for a stream along the unit vector `stream` (..., 3)."""
    along, side, up = stream_axes(stream)
    return (force * up).sum(-1), (force * side).sum(-1), (force * along).sum(-1)
