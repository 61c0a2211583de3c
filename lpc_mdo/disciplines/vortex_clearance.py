"""Meshes on which a vortex lattice's equations mean nothing, and wakes that pass through surfaces.

A lattice knows the flow down to about half a panel from its vortices. Two surfaces nearer than that, or one that folds back
on itself, see single vortices of each other instead of a sheet, and the lift may come out ten times too large without any
other sign of it. At half a panel it is right to 3 % (test_vortex_clearance.py); a finer mesh allows a smaller gap.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np  # no gradients here, and on arrays as small as these it is several times as fast as PyTorch
from numpy.typing import NDArray
from torch import Tensor

from lpc_mdo.disciplines.vortex_topology import Lattice, lattice_of

Array = NDArray[np.floating]
SHARPEST = 1e-4  # least area of a panel over the square of its longer side: beyond, rounding errors decide the lift
LEAST_GAP = 0.5  # panels, between surfaces that lie along each other
LEAST_CROSSING = 0.02  # panels, between a control point and a surface that crosses its own at a right angle
PAIRS = 1 << 18  # of points and panels looked at together: bounds the memory of large lattices
LEAST_PASSAGE = 0.25  # widths of a strip, between its wake and a control point
MIRROR = np.array([1.0, -1.0, 1.0])


class _Frames(NamedTuple):
    """Mean shape of panels, vectors (3, member, panel) and numbers (member, panel)."""

    diagonals: Array  # (3, member, 2, panel) m, from front port and front starboard
    middles: Array  # (3, member, 2, panel) m, twice the middles of the diagonals
    normal: Array  # m^2, as long as the panel's area
    squared_area: Array  # m^4
    squared_side: Array  # m^2, of the longer one

    @property
    def center(self) -> Array:
        found: Array = 0.25 * self.middles.sum(2)
        return found

    @property
    def along(self) -> Array:
        """From the middle of the front to that of the rear edge, m."""
        found: Array = 0.5 * self.diagonals.sum(2)
        return found

    @property
    def across(self) -> Array:
        """From the middle of the port to that of the starboard edge, m."""
        return 0.5 * (self.diagonals[:, :, 0] - self.diagonals[:, :, 1])

    @property
    def twist(self) -> Array:
        """Half of what the corners are off a parallelogram, m."""
        return 0.5 * (self.middles[:, :, 0] - self.middles[:, :, 1])


def require_sound_meshes(lattice: Lattice, nodes: Tensor, names: Sequence[str], is_symmetric: bool) -> None:
    """Refuse meshes of nodes (..., node, 3) m on which the lattice would solve for nonsense.

    names: what the surfaces are called in the message; is_symmetric: the mirror image in y = 0 is there, too. What is not a
    number passes. Raises ValueError if a panel is flat or crossed, or if surfaces, or strips of one that do not adjoin, are
    closer than half a panel (the longer side of the larger one). Surfaces that meet at an edge or cross at a right angle
    are not close, unless control points fall on the other.
    """
    members = nodes.detach().cpu().numpy().reshape(-1, *nodes.shape[-2:])
    if not members.size:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        if not _is_plain(lattice, members.transpose(2, 0, 1)):
            frames = _frames(lattice, np.moveaxis(members, -1, 0))
            _require_areas(lattice, frames, names)
            _require_gaps(lattice, frames, names, is_image=False)
            if is_symmetric:
                _require_gaps(lattice, frames, names, is_image=True)


def _cross(a: Array, b: Array) -> Array:
    """As numpy.cross along the first axis, several times as fast on small arrays."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _dot(a: Array, b: Array) -> Array:
    found: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return found


def _frames(lattice: Lattice, nodes: Array) -> _Frames:
    corners = nodes[..., lattice.corners.numpy()]
    front, rear = corners[:, :, :2], corners[:, :, 3:1:-1]  # port and starboard, and what lies opposite
    diagonals = rear - front
    forward, backward = diagonals[:, :, 0], diagonals[:, :, 1]
    normal = 0.5 * _cross(backward, forward)
    squares = (diagonals * diagonals).sum((0, 2)) + 2.0 * np.abs((forward * backward).sum(0))
    return _Frames(diagonals, rear + front, normal, (normal * normal).sum(0), 0.25 * squares)


def _is_plain(lattice: Lattice, nodes: Array) -> bool:
    """Whether a glance at nodes (3, member, node) shows that all is well: sound panels that face up within 45 degrees, in boxes
    that are far apart.

    Every evaluation of an aircraft pays for this, so it takes few steps, and bounds where `_frames` computes.
    """
    corners = nodes.take(lattice.corners.numpy().ravel(), axis=2).reshape(3, nodes.shape[1], 4, -1)
    port, starboard, rear_port, rear_starboard = (corners[:, :, k] for k in range(4))
    vectors = np.stack([rear_starboard - port, rear_port - starboard, port + rear_starboard - starboard - rear_port])
    forward, backward, _ = vectors
    forward_squared, backward_squared, twist_squared = np.einsum("vcmp,vcmp->vmp", vectors, vectors)
    product = np.einsum("cmp,cmp->mp", forward, backward)
    height = backward[0] * forward[1] - backward[1] * forward[0]  # twice the area seen from above
    squared_area = forward_squared * backward_squared - product * product  # four times
    squared_side = 2.0 * (forward_squared + backward_squared)  # at least four times the longer side's
    squared_height = height * height
    # Triangles at the corners have areas of one sign if the twist is small.
    is_sound = (2.0 * squared_height >= squared_area) & (squared_height > (0.5 * SHARPEST * squared_side) ** 2)
    is_sound &= twist_squared * squared_side <= squared_area
    if not is_sound.all() or height.min() < 0.0 < height.max():
        return False
    first = np.cumsum([0, *((c + 1) * (s + 1) for c, s in lattice.shapes[:-1])])
    low, high = np.minimum.reduceat(nodes.min(1), first, axis=-1), np.maximum.reduceat(nodes.max(1), first, axis=-1)
    between = np.maximum(low[:, :, None], low[:, None, :]) - np.minimum(high[:, :, None], high[:, None, :])
    is_far = between.max(0) > 0.5 * LEAST_GAP * float(squared_side.max()) ** 0.5
    return bool((is_far | np.eye(len(first), dtype=bool)).all())


def _require_areas(lattice: Lattice, frames: _Frames, names: Sequence[str]) -> None:
    """Panels must have an area, and so must the triangles at their corners, whose areas are negative where edges cross."""
    along, across, turned = frames.along, frames.across, _cross(frames.normal, frames.twist)
    skew = np.abs(_dot(turned, along)) + np.abs(_dot(turned, across))
    is_vast = (np.abs(frames.middles) > np.finfo(along.dtype).max ** 0.2).any((0, 2))  # fourth powers overflow
    is_flat = is_vast | (frames.squared_area <= (SHARPEST * frames.squared_side) ** 2)
    is_unsound = is_flat | (skew > (1.0 + SHARPEST) * frames.squared_area)
    if is_unsound.any():
        at = int(np.flatnonzero(is_unsound.any(0))[0])
        which, row, strip = _panel(lattice, at)
        member = int(np.flatnonzero(is_unsound[:, at])[0])
        chord, span = (float(np.linalg.norm(vector[:, member, at])) for vector in (along, across))
        raise ValueError(
            f"{names[which]} is invalid: its panels must have an area, sides within a factor of ten thousand and edges that do "
            f"not cross; the one in row {row}, strip {strip} measures {chord:.3g} m along the chord and {span:.3g} m across"
        )


def _panel(lattice: Lattice, index: int) -> tuple[int, int, int]:
    """Surface, row and strip of a panel among all."""
    which = 0
    while index >= lattice.panel_sizes[which]:
        index -= lattice.panel_sizes[which]
        which += 1
    return which, *divmod(index, lattice.shapes[which][1])


def _require_gaps(lattice: Lattice, frames: _Frames, names: Sequence[str], *, is_image: bool) -> None:
    """Distances of control points (their mirror images if `is_image`) from the panels that they lie above or below."""
    center, along, across, normal, squared_area = (
        frames.center,
        frames.along,
        frames.across,
        frames.normal,
        frames.squared_area,
    )
    unit, side = normal / np.sqrt(squared_area), np.sqrt(frames.squared_side)
    # Products with a distance are its shares of `along` and `across`, and its height above the panel.
    axes = np.concatenate([_cross(across, normal) / squared_area, _cross(normal, along) / squared_area, unit], axis=-1)
    offset = _dot(axes, np.concatenate([center] * 3, axis=-1))[:, None, :]
    points, normals, axes, unit = (np.moveaxis(v, 0, -1) for v in (center + 0.25 * along, unit, axes, unit))
    if is_image:
        points, normals = points * MIRROR, normals * MIRROR
    apart = (lattice.image_apart if is_image else lattice.strips_apart).numpy()
    count = points.shape[1]
    size = max(1, PAIRS // points[..., 0].size)
    for start in range(0, count, size):
        part = slice(start, start + size)
        place = np.abs(points[:, part] @ axes.swapaxes(1, 2) - offset)
        above = place[..., 2 * count :]
        least = np.maximum(LEAST_GAP * np.abs(normals[:, part] @ unit.swapaxes(1, 2)), LEAST_CROSSING)
        least *= np.maximum(side[:, part, None], side[:, None, :])
        is_inside = np.maximum(place[..., :count], place[..., count : 2 * count]) <= 0.5 + SHARPEST
        is_close = is_inside & (above < least) & apart[part]
        if is_close.any():
            ratio = np.where(is_close, above / least, np.inf)
            raise ValueError(_closeness(lattice, names, ratio, above, least, start, is_image))


def _closeness(
    lattice: Lattice, names: Sequence[str], ratio: Array, above: Array, least: Array, start: int, is_image: bool
) -> str:
    at = np.unravel_index(np.argmin(ratio), ratio.shape)
    first, second = _panel(lattice, start + int(at[1]))[0], _panel(lattice, int(at[2]))[0]
    if is_image:
        who = f"{names[first]} and the mirror image of {names[second]}"
    elif first == second:
        who = f"parts of {names[first]} that do not adjoin"
    else:
        who = f"{names[min(first, second)]} and {names[max(first, second)]}"
    return (
        f"{who} are {above[at]:.3g} m apart, too close for their panels: the gap must be at least {least[at]:.3g} m on this "
        "mesh; refine it or leave a surface out"
    )


def wake_passages(meshes: Sequence[Tensor], wake: Tensor) -> list[tuple[int, int]]:
    """Pairs of surfaces (shedding, met) of which the first one's wake passes through the second one, or all but.

    meshes: corners (chordwise + 1, spanwise + 1, 3) m, as for `vortex_lattice`, one condition; wake (3,): unit vector along
    which they trail. A control point is met if a strip's wake passes within a quarter of the strip's width: what it feels
    there is decided by the vortices' core, and converges slowly with the mesh.
    """
    direction = wake.detach().cpu().numpy()
    across = np.linalg.svd(direction[None, :])[2][1:].T  # (3, 2)
    edges = [mesh[-1].detach().cpu().numpy() for mesh in meshes]
    lattice = lattice_of(tuple((mesh.shape[0] - 1, mesh.shape[1] - 1) for mesh in meshes))
    nodes = np.concatenate([mesh.detach().cpu().numpy().reshape(-1, 3) for mesh in meshes])
    front, rear = (nodes[lattice.corners[k]] + nodes[lattice.corners[k + 1]] for k in (0, 2))
    points = np.split(0.125 * front + 0.375 * rear, np.cumsum(lattice.panel_sizes)[:-1])
    return [
        (shedding, met)
        for shedding, edge in enumerate(edges)
        for met, own in enumerate(points)
        if _is_met(edge, own, direction, across)
    ]


def _is_met(edge: Array, points: Array, direction: Array, across: Array) -> bool:
    start, strip = (edge[:-1] @ across), (edge[1:] - edge[:-1]) @ across
    arm = (points @ across)[:, None, :] - start
    squared_width = np.maximum((strip * strip).sum(-1), np.finfo(float).tiny)
    share = np.clip((arm * strip).sum(-1) / squared_width, 0.0, 1.0)
    miss = arm - share[..., None] * strip
    begins = (edge[:-1] + share[..., None] * (edge[1:] - edge[:-1])) @ direction
    is_behind = (points @ direction)[:, None] > begins
    return bool((is_behind & ((miss * miss).sum(-1) < LEAST_PASSAGE**2 * squared_width)).any())
