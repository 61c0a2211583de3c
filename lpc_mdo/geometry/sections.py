"""NACA four-digit sections, and their B-spline control points."""

import numpy as np
from scipy.interpolate import make_lsq_spline

from lpc_mdo.numerics.bsplines import clamped_knots


def naca_camber_line(digits: str, x: np.ndarray) -> np.ndarray:
    """Mean line z/c at the stations x/c, each (n,). Source: Abbott and von Doenhoff, section 6.4."""
    camber, position = int(digits[0]) / 100, int(digits[1]) / 10
    if camber == 0.0 or position == 0.0:
        return np.zeros_like(x)
    ahead = camber / position**2 * (2 * position * x - x**2)
    behind = camber / (1 - position) ** 2 * (1 - 2 * position + 2 * position * x - x**2)
    return np.where(x < position, ahead, behind)


def naca_four_digit(digits: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower ordinates z/c at the stations x/c, each (n,).

    Thickness is laid off normal to the chord, so that the mean of both is the exact camber line; the closed
    trailing edge takes the coefficient -0.1036. Source: Abbott and von Doenhoff, section 6.4.
    """
    thickness = int(digits[2:]) / 100
    half = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    line = naca_camber_line(digits, x)
    return line + half, line - half


def section_control_points(digits: str, count: int, degree: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Control points (count, 2) of the upper and the lower side of a unit-chord section.

    The parameter u runs from leading (0) to trailing edge (1) with x/c = u^2, in which the nose, z ~ sqrt(x), is
    smooth. Both sides share u, hence the mean of the two surfaces is the camber line.
    """
    u = np.linspace(0.0, 1.0, 401)
    knots = clamped_knots(count, degree)
    sides = []
    for ordinate in naca_four_digit(digits, u**2):
        points = np.stack([u**2, ordinate], axis=1)
        fitted = make_lsq_spline(u, points, knots, degree).c
        fitted[0], fitted[-1] = points[0], points[-1]
        sides.append(fitted)
    return sides[0], sides[1]
