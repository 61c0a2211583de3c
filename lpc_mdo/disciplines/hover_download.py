"""What lift rotors cost the airframe: download of their wakes in hover, and drag of their stopped blades in cruise.

Wakes: momentum theory with the axial velocity of a vortex cylinder, v = v_i (1 + s/sqrt(1 + s^2)) at s radii below the disk, and the
contraction that continuity asks for; the air's density cancels. Source: McCormick, Aerodynamics of V/STOL Flight
(1967); Leishman, Principles of Helicopter Aerodynamics (2006), section 2.2. What stands in a wake has its area and drag coefficient, as
in NDARC. Fountains between wakes, swirl and what wakes draw in beside them are left out. Computed flow about NASA's Lift+Cruise has a
download of about 10 % of the weight (NTRS 20230016503), this model 2.3 %, nearly all on the booms: it tells what moving rotors or wing
changes, and leaves out the rest.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.smooth import safe_norm

# Hoerner, Fluid-Dynamic Drag (1965), chapter 3: two-dimensional bodies across the flow.
PLATE_DRAG = 1.98
CYLINDER_DRAG = 1.17  # below the critical Reynolds number
SECTION_DRAG = 0.012  # of a blade along its chord: NASA's concept vehicles take 0.010 to 0.012
FRICTION = (
    0.004  # of a blade along its span, one side: ASSUMED, a turbulent plate at a Reynolds number of some millions
)
EDGE = 0.05  # of the radius: ASSUMED half width of the wake's edge, which sheds and smooths


@dataclass(frozen=True)
class HoverDownload:
    """Downward force (..., element) N, and its share of the thrust (...,)."""

    force: Tensor
    share: Tensor

    @property
    def total(self) -> Tensor:
        return self.force.sum(-1)


def wake_pressure(thrust: Tensor, radius: Tensor, center: Tensor, points: Tensor) -> Tensor:
    """Dynamic pressure (..., point) Pa of all wakes at points (..., point, 3) m, x and y level, z up.

    thrust (..., rotor) N, radius (..., rotor) m and center (..., rotor, 3) m of level disks in hover.
    """
    offset = points[..., :, None, :] - center[..., None, :, :]  # (..., point, rotor, 3)
    radius, thrust = radius[..., None, :], thrust[..., None, :]
    below = -offset[..., 2] / radius
    growth = 1.0 + below / torch.sqrt(
        1.0 + below**2
    )  # of the induced velocity at the disk: from 0 far above to 2 far below
    wake_radius = radius / torch.sqrt(growth)
    across = safe_norm(offset[..., :2])
    share = torch.sigmoid((wake_radius - across) / (0.5 * EDGE * radius))
    loading = thrust / (torch.pi * radius**2)  # the dynamic pressure far below
    return (0.25 * loading * growth**2 * share).sum(-1)


def hover_download(
    thrust: Tensor, radius: Tensor, center: Tensor, points: Tensor, area: Tensor, drag_coefficient: Tensor
) -> HoverDownload:
    """Download of elements of area (..., element) m^2 seen from above, with their drag coefficient (..., element), at points.

    Other arguments as for `wake_pressure`, one point an element. Elements should be small beside a rotor. Wakes that overlap add.
    """
    force = wake_pressure(thrust, radius, center, points) * area * drag_coefficient
    return HoverDownload(force, force.sum(-1) / thrust.sum(-1))


def stopped_rotor_drag_area(
    chord: Tensor, width: Tensor, twist: Tensor, azimuth: Tensor, hub_area: float | Tensor = 0.0
) -> Tensor:
    """Drag area (...,) m^2 of a stopped rotor in the plane of the stream: blades by strips, and a hub's own (...,).

    chord (..., station) m, width (..., station) m of the strips, twist (..., station) rad from the disk; azimuth (..., blade) rad of
    each blade's span from the stream: 0 and pi lie along it. What flows across a blade meets a plate at its twist, what flows along it
    rubs on both sides: the independence principle of swept wings. The study's scripts have 1.2 ft^2 for all eight hubs and blades; in a
    wind tunnel L/D fell from 17 to 13 with blades along the stream and to 9 across (Bacchini et al. 2021).
    """
    strip = chord * width
    across = (strip * (SECTION_DRAG + PLATE_DRAG * torch.sin(twist) ** 2)).sum(-1)
    along = (strip * 2.0 * FRICTION).sum(-1)
    sine, cosine = torch.sin(azimuth), torch.cos(azimuth)
    return (across[..., None] * (sine**2) ** 1.5 + along[..., None] * (cosine**2) ** 1.5).sum(-1) + hub_area
