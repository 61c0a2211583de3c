"""The wing that all vortex lattices are asked for: flat, straight-tapered by sections, whole span, uniform panels."""

import numpy as np

HALF_SPAN = 4.0  # m
SECTIONS = 6  # from root to tip, equally spaced: one chord and one twist each
SPEED, DENSITY = 50.0, 1.1  # m/s, kg/m^3


def section_positions() -> np.ndarray:
    """y (section,) of the starboard sections, m."""
    return np.linspace(0.0, HALF_SPAN, SECTIONS)


def start() -> np.ndarray:
    """The variables (13,): chords (m) and twists (rad, about the leading edge) of the sections, angle of attack (rad).

    Without twist all lattices are of one plane, in which rings and horseshoes are the same vortices.
    """
    return np.concatenate([np.linspace(1.2, 0.8, SECTIONS), np.zeros(SECTIONS), [np.radians(4.0)]])


def interpolation(y: np.ndarray) -> np.ndarray:
    """Weights (point, section) of straight lines between the sections, at |y|."""
    pitch = HALF_SPAN / (SECTIONS - 1)
    return np.clip(1.0 - np.abs(np.abs(y)[:, None] - section_positions()) / pitch, 0.0, None)
