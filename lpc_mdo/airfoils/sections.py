"""Sections of lifting surfaces: NACA four-digit designations and coordinate files, and their B-spline control points."""

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator, make_lsq_spline

from lpc_mdo.airfoils.coordinate_file import AirfoilSection, read_airfoil_file
from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import is_there

SHIPPED = Path(__file__).parents[1] / "data" / "airfoils"


def section_name(airfoil: str, folder: Path = Path()) -> str:
    """The four digits of a NACA section, the name of a shipped coordinate file, or the path of one from `folder`.

    Raises ValueError if it is none of these.
    """
    if digits := re.fullmatch(r"(?:naca)?[ -]?(\d{4})", airfoil.strip().lower()):
        return digits[1]
    if airfoil in shipped_sections():
        return airfoil
    file = folder / Path(airfoil).expanduser()
    if not airfoil.strip() or not is_there(file):
        raise ValueError(
            f"airfoil = {shortened(airfoil)} is invalid: it must be a NACA section of four digits, one of "
            f"{', '.join(shipped_sections())}, or a coordinate file"
        )
    try:
        coordinates(str(file.resolve()))
    except ValueError as error:
        raise ValueError(f"airfoil = {airfoil!r} is invalid: {str(error).rstrip('.')}") from None
    return str(file.resolve())


def shipped_sections() -> tuple[str, ...]:
    """Names of the coordinate files that come with the package."""
    return tuple(sorted(file.stem for file in SHIPPED.glob("*.dat")))


@cache
def coordinates(name: str) -> AirfoilSection:
    """The cleaned section of a shipped or own coordinate file. Raises ValueError, with file and line, if it is none."""
    if name in shipped_sections():
        return read_airfoil_file(SHIPPED / f"{name}.dat")
    return read_airfoil_file(Path(name))


def section_thickness(name: str) -> float:
    """Largest thickness in chords of a section as `section_name` returns it."""
    return int(name[2:]) / 100.0 if re.fullmatch(r"\d{4}", name) else coordinates(name).thickness_to_chord


def section_ordinates(name: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower ordinates z/c at the stations x/c, each (n,), of a section as `section_name` returns it.

    Coordinates are interpolated along sqrt(x/c), in which the nose is smooth. What is left at the trailing edge is taken off in
    proportion to x/c: of a blunt one half the gap from either side, of one off the axis its height, so that the chord ends there.
    """
    if re.fullmatch(r"\d{4}", name):
        return naca_four_digit(name, x)
    points = coordinates(name).points
    nose = int(points[:, 0].argmin())
    upper = _along(points[nose::-1], x)
    lower = _along(points[nose:], x)
    top, bottom = _along(points[nose::-1], np.ones(1)), _along(points[nose:], np.ones(1))
    return upper - top * x, lower - bottom * x


def _along(side: np.ndarray, x: np.ndarray) -> np.ndarray:
    along, ordinates = np.sqrt(np.maximum(side[:, 0], 0.0)), side[:, 1]
    keep = np.r_[True, np.diff(np.maximum.accumulate(along)) > 1e-9]
    return PchipInterpolator(along[keep], ordinates[keep], extrapolate=True)(np.sqrt(x))


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
    line, half = naca_camber_line(digits, x), naca_half_thickness(int(digits[2:]) / 100, x)
    return line + half, line - half


def naca_half_thickness(thickness_to_chord: float, x: np.ndarray) -> np.ndarray:
    """Half the thickness in chords at the stations x/c, (n,), of a NACA four-digit section of any thickness."""
    shape = 0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    return 5 * thickness_to_chord * shape


def section_control_points(name: str, count: int, degree: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Control points (count, 2) of the upper and the lower side of a unit-chord section as `section_name` returns it."""
    return _fitted(lambda x: section_ordinates(name, x), count, degree)


def symmetric_control_points(thickness_to_chord: float, count: int, degree: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """As `section_control_points`, of a symmetric NACA four-digit section of any thickness."""

    def ordinates(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        half = naca_half_thickness(thickness_to_chord, x)
        return half, -half

    return _fitted(ordinates, count, degree)


def _fitted(
    ordinates: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], count: int, degree: int
) -> tuple[np.ndarray, np.ndarray]:
    """Control points of both sides by least squares.

    The parameter u runs from leading (0) to trailing edge (1) with x/c = u^2, in which the nose, z ~ sqrt(x), is
    smooth. Both sides share u, hence the mean of the two surfaces is the camber line.
    """
    from lpc_mdo.numerics.bsplines import clamped_knots  # here, since files are read without torch

    u = np.linspace(0.0, 1.0, 401)
    knots = clamped_knots(count, degree)
    sides = []
    for ordinate in ordinates(u**2):
        points = np.stack([u**2, ordinate], axis=1)
        fitted = make_lsq_spline(u, points, knots, degree).c
        fitted[0], fitted[-1] = points[0], points[-1]
        sides.append(fitted)
    return sides[0], sides[1]
