"""Tails: static margin at several centres of gravity, and the moments of fins and hinged surfaces.

Slopes by DATCOM's formula for wings of any aspect ratio, hinged surfaces by thin-airfoil theory with a factor for the boundary layer.
Sources: Hoak et al., USAF Stability and Control DATCOM (1978), section 4.1.3.2; Katz and Plotkin, Low-Speed Aerodynamics (2001), section
5.4. Sidewash and the slipstream of rotors are left out.
"""

import math

import torch
from torch import Tensor

from lpc_mdo.disciplines.stability_derivatives import Reference, StabilityDerivatives

FIN_END_PLATE = (
    1.55  # effective over geometric aspect ratio of a fin on a fuselage: Raymer, Aircraft Design (2018), section 16.4
)
VISCOUS_FACTOR = (
    0.8  # of the theory's effect of a hinged surface: ASSUMED, DATCOM's figures have 0.6 to 0.9 at 20 degrees
)


def static_margins(derivatives: StabilityDerivatives, reference: Reference, center_x: Tensor) -> Tensor:
    """Static margins (..., loading) in mean chords at centres of gravity center_x (..., loading) m, x aft.

    From derivatives (...,) about the point of `reference`, which one evaluation of the lattice gives for all loadings; heights of the
    centres are taken as that point's.
    """
    aft = (center_x - reference.point[..., 0, None]) / reference.chord[..., None]
    return derivatives.static_margin()[..., None] - aft


def lift_slope(aspect_ratio: Tensor, half_chord_sweep: float | Tensor = 0.0, mach: float | Tensor = 0.0) -> Tensor:
    """Slope (...,) 1/rad of a lifting surface: 2 pi A/(2 + sqrt(A^2 (1 - M^2 + tan^2 sweep) + 4)), sections of slope 2 pi/beta.

    aspect_ratio (...,), half_chord_sweep (...,) rad, mach (...,) below 1.
    """
    sweep, mach = (torch.as_tensor(value, dtype=aspect_ratio.dtype) for value in (half_chord_sweep, mach))
    stretched = 1.0 - mach**2 + torch.tan(sweep) ** 2
    return 2.0 * math.pi * aspect_ratio / (2.0 + torch.sqrt(aspect_ratio**2 * stretched + 4.0))


def flap_effectiveness(chord_share: Tensor) -> Tensor:
    """Change of zero-lift angle over deflection (...,) of a plain flap over a share (...,) of the chord, thin airfoil; 0 to 1."""
    hinge = torch.acos(2.0 * chord_share - 1.0)
    return 1.0 - (hinge - torch.sin(hinge)) / math.pi


def surface_moment(dynamic_pressure: Tensor, area: Tensor, slope: Tensor, angle: Tensor, arm: Tensor) -> Tensor:
    """Moment (...,) N m of a surface of area m^2 and slope 1/rad at an angle rad to the stream, with its arm m; each (...,)."""
    return dynamic_pressure * area * slope * angle * arm


def control_moment(
    dynamic_pressure: Tensor,
    area: Tensor,
    slope: Tensor,
    arm: Tensor,
    deflection: Tensor,
    chord_share: Tensor,
    viscous_factor: float | Tensor = VISCOUS_FACTOR,
) -> Tensor:
    """Moment (...,) N m of a hinged surface over all the span of a tail, as `surface_moment`; deflection (...,) rad."""
    angle = viscous_factor * flap_effectiveness(chord_share) * deflection
    return surface_moment(dynamic_pressure, area, slope, angle, arm)


def required_area(moment: Tensor, moment_per_area: Tensor) -> Tensor:
    """Area (...,) m^2 of a tail for a moment (...,) N m of either sign, from what each square metre of it gives (...,) N/m."""
    return torch.sqrt(moment**2 + 1e-12) / moment_per_area


def fin_yaw_stiffness(fin_area: Tensor, fin_slope: Tensor, fin_arm: Tensor, reference: Reference) -> Tensor:
    """What a fin adds to the slope of yawing moment by sideslip (...,) 1/rad: weathercock stability, positive.

    fin_area (...,) m^2, fin_slope (...,) 1/rad, fin_arm (...,) m behind the centre of gravity.
    """
    return fin_slope * fin_area * fin_arm / (reference.area * reference.span)
