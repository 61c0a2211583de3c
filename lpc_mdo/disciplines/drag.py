"""Parasitic drag areas by component build-up: skin friction x form factor x interference x wetted area.

Source: Raymer, Aircraft Design: A Conceptual Approach, 6th ed. (2018), section 12.5. The friction is turbulent all
over. Drag that grows with lift is the vortex lattice's; the viscous part of it is not modelled.
"""

import math

import torch
from torch import Tensor

LEAST_REYNOLDS = 1e3


def turbulent_friction_coefficient(reynolds: Tensor, mach: Tensor) -> Tensor:
    """Mean skin friction (...,) of a smooth turbulent plate, Raymer eq. 12.27 (Prandtl-Schlichting).

    Raises ValueError unless reynolds exceeds 1000, far below any turbulent plate.
    """
    if bool((reynolds <= LEAST_REYNOLDS).any()):
        least = float(reynolds.detach().min())
        raise ValueError(f"reynolds = {least:g} is invalid: it must exceed {LEAST_REYNOLDS:g} for turbulent friction")
    return 0.455 / (torch.log10(reynolds) ** 2.58 * (1.0 + 0.144 * mach**2) ** 0.65)


def surface_form_factor(
    thickness_to_chord: Tensor | float, mach: Tensor, maximum_thickness_position: float = 0.3
) -> Tensor:
    """Form factor (...,) of an unswept lifting surface, Raymer eq. 12.30."""
    thickness = 0.6 / maximum_thickness_position * thickness_to_chord + 100.0 * thickness_to_chord**4
    return (1.0 + thickness) * 1.34 * mach**0.18


def body_form_factor(length: Tensor, diameter: Tensor | float) -> Tensor:
    """Form factor (...,) of a fuselage-like body, Raymer eq. 12.31."""
    fineness = length / diameter
    return 1.0 + 60.0 / fineness**3 + fineness / 400.0


def surface_wetted_area(exposed_area: Tensor, thickness_to_chord: Tensor | float) -> Tensor:
    """Both sides of a lifting surface (...,) m^2, Raymer eq. 7.12."""
    return exposed_area * (1.977 + 0.52 * thickness_to_chord)


def tube_wetted_area(length: Tensor, diameter: Tensor | float) -> Tensor:
    """Lateral area (...,) m^2 of a tube."""
    return math.pi * diameter * length
