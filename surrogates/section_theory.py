"""What theory gives where the polars of a section end: a stalled plate, and the drag rise of shocks."""

import torch
from torch import Tensor

NORMAL_FORCE_AT_90 = 1.98  # two-dimensional plate across the flow, Lindenburg, ECN-C-03-025 (2003)
STALLED_FRICTION = 0.02  # drag along the chord of a stalled section, ASSUMED: twice the attached drag
KORN_FACTOR = 0.87  # conventional sections, Mason, Configuration Aerodynamics (2006)
LOCK_FACTOR = 20.0  # of the fourth power of the Mach number beyond the critical one, Hilton after Lock, Mason (2006)
LARGEST_DRAG_RISE = 0.1  # order of a 12 % section at Mach 1 by transonic similarity, ASSUMED for every section


def stalled_plate(sin: Tensor, cos: Tensor) -> tuple[Tensor, Tensor]:
    """Lift and drag coefficient of a stalled plate from sine and cosine of its angle.

    Normal force c90 sin a/(0.56 + 0.44 |sin a|) for an infinite aspect ratio. Source: Lindenburg, ECN-C-03-025 (2003),
    after Hoerner, Fluid-Dynamic Drag (1965).
    """
    size = torch.sqrt(sin**2 + 1e-4)
    normal = NORMAL_FORCE_AT_90 * sin / (0.56 + 0.44 * size)
    return normal * cos, normal * sin + STALLED_FRICTION * cos**2


def drag_rise(cl: Tensor, mach: Tensor, held_mach: Tensor, thickness_to_chord: float) -> Tensor:
    """What the drag of shocks (...,) grows by from the Mach number that the network was asked to the true one.

    The critical Mach number is Korn's, the rise Lock's: 20 (M - M_critical)^4. Source: Mason, Configuration
    Aerodynamics (2006), ch. 7. Levels off at LARGEST_DRAG_RISE, far beyond where Lock's power holds.
    """
    lift = torch.sqrt(cl**2 + 0.01)  # without the corner of |cl|
    # Drag divergence, where dcd/dM = 0.1, less the way from the critical Mach number to there.
    critical = KORN_FACTOR - thickness_to_chord - (0.1 / (4.0 * LOCK_FACTOR)) ** (1.0 / 3.0) - 0.1 * lift
    excess, known = (mach - critical).clamp(min=0.0), (held_mach - critical).clamp(min=0.0)
    rise = LOCK_FACTOR * (excess**4 - known**4)
    return LARGEST_DRAG_RISE * torch.tanh(rise / LARGEST_DRAG_RISE)
