"""Sections to run XFOIL on: NACA four- and five-digit designations, and coordinate files."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

FEWEST_POINTS, MOST_POINTS = 20, 1000  # of a coordinate file; XFOIL holds some 600 and is given no more than 300
SENT_POINTS = 300
THICKNESS = (0.03, 0.4)  # of the chord


@dataclass(frozen=True)
class AirfoilShape:
    """designation: the digits of a NACA section, or empty where coordinates (point, 2) describe it: x from the leading
    edge in chords, from the trailing edge over the upper side around to the trailing edge."""

    name: str
    thickness_to_chord: float
    designation: str = ""
    coordinates: tuple[tuple[float, float], ...] = ()

    @property
    def key(self) -> str:
        """Tells two sections of one name apart."""
        return hashlib.sha256(repr((self.designation, self.coordinates)).encode()).hexdigest()[:12]


def airfoil_shape(name_or_file: str) -> AirfoilShape:
    """A section from 'naca4412', '4412', 'naca 23012' or the path of a coordinate file.

    Raises ValueError that names what is wrong.
    """
    if match := re.fullmatch(r"(?:naca)?[ -]?(\d{4,5})", name_or_file.strip().lower()):
        return _naca(match[1])
    file = Path(name_or_file)
    if not file.is_file():
        raise ValueError(
            f"airfoil = {name_or_file!r} is not allowed; it must be a NACA section of four or five digits or a "
            "coordinate file"
        )
    if file.stat().st_size > 1_000_000:
        raise ValueError(f"{file}: {file.stat().st_size} bytes are not allowed; a coordinate file has at most 1000000")
    return _from_coordinates(_stem(file), _read_coordinates(file), str(file))


def _stem(file: Path) -> str:
    name = re.sub(r"[^a-z0-9_.-]+", "_", file.stem.lower()).strip("._-")
    if not name:
        raise ValueError(f"{file}: its name is not allowed; it must hold a letter or digit to name the section by")
    return name


def _naca(digits: str) -> AirfoilShape:
    thickness = int(digits[-2:]) / 100.0
    if not THICKNESS[0] <= thickness <= THICKNESS[1]:
        raise ValueError(f"airfoil = {digits!r} is not allowed; its thickness (last two digits) must lie in 03 to 40")
    if len(digits) == 4 and (digits[0] == "0") != (digits[1] == "0"):
        raise ValueError(
            f"airfoil = {digits!r} is not allowed; camber and its position (first two digits) must both be zero or neither"
        )
    if len(digits) == 5 and not re.fullmatch(r"2[1-5]0\d\d", digits):
        raise ValueError(
            f"airfoil = {digits!r} is not allowed; five-digit sections begin with 210, 220, 230, 240 or 250"
        )
    return AirfoilShape(f"naca{digits}", thickness, digits)


def _read_coordinates(file: Path) -> np.ndarray:
    """Pairs (point, 2) of a file in Selig's order (around the section) or Lednicer's (upper side, then lower side)."""
    pairs: list[tuple[float, float]] = []
    lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines, 1):
        cells = line.replace(",", " ").split()
        try:
            pair = tuple(float(cell) for cell in cells)
        except ValueError:
            pair = ()
        if len(pair) == 2 and all(np.isfinite(pair)):
            pairs.append(pair)  # type: ignore[arg-type]
        elif cells and pairs:
            raise ValueError(
                f"{file}: {line.strip()[:40]!r} is not allowed; it must be two finite numbers (line {number})"
            )
    if pairs and min(pairs[0]) > 1.5:  # Lednicer's files begin with the numbers of points of both sides
        upper = round(pairs[0][0])
        points = pairs[1:]
        if len(points) != upper + round(pairs[0][1]):
            raise ValueError(f"{file}: {len(points)} points are not allowed; its header says {pairs[0]}")
        pairs = [*reversed(points[:upper]), *points[upper:]]
    if not FEWEST_POINTS <= len(pairs) <= MOST_POINTS:
        raise ValueError(f"{file}: {len(pairs)} points are not allowed; there must be {FEWEST_POINTS} to {MOST_POINTS}")
    return np.array(pairs)


def _from_coordinates(name: str, points: np.ndarray, place: str) -> AirfoilShape:
    """Chord 1, leading edge at the origin; the angle of attack stays that of the given axes."""
    keep = np.r_[True, np.hypot(*np.diff(points, axis=0).T) > 1e-9]  # Lednicer's files repeat the leading edge
    points = points[keep]
    nose = points[points[:, 0].argmin()]
    chord = points[:, 0].max() - nose[0]
    if not chord > 0.0:
        raise ValueError(f"{place}: the x coordinates are not allowed; they are all the same")
    points = (points - nose) / chord
    start, end = points[0], points[-1]
    front = int(points[:, 0].argmin())
    if min(start[0], end[0]) < 0.9 or not 3 <= front <= len(points) - 4:
        raise ValueError(
            f"{place}: the order of points is not allowed; it must run from the trailing edge around the leading edge back"
        )
    if _area(points) < 0.0:
        points = points[::-1]
        front = len(points) - 1 - front
    stations = np.linspace(0.0, 1.0, 401)
    upper = np.interp(stations, points[front::-1, 0], points[front::-1, 1])
    lower = np.interp(stations, points[front:, 0], points[front:, 1])
    thickness = float((upper - lower).max())
    if not THICKNESS[0] <= thickness <= THICKNESS[1]:
        raise ValueError(
            f"{place}: a thickness of {thickness:.3g} chords is not allowed; it must lie between {THICKNESS[0]} and "
            f"{THICKNESS[1]}"
        )
    if len(points) > SENT_POINTS:
        points = points[np.unique(np.r_[np.linspace(0, len(points) - 1, SENT_POINTS - 1).round().astype(int), front])]
    rows: Sequence[Sequence[float]] = points.round(7).tolist()
    return AirfoilShape(name, thickness, coordinates=tuple((x, y) for x, y in rows))


def _area(points: np.ndarray) -> float:
    """Signed area; positive where points run counter-clockwise, upper side first."""
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


# Of the mean lines 210 to 250: where the cubic ends, and its factor. Source: Abbott and von Doenhoff (1959), table.
FIVE_DIGIT_LINES = {
    "1": (0.058, 361.4),
    "2": (0.126, 51.64),
    "3": (0.2025, 15.957),
    "4": (0.29, 6.643),
    "5": (0.391, 3.23),
}


def section_coordinates(shape: AirfoilShape) -> np.ndarray:
    """Points (point, 2) around the section, of a NACA section as XFOIL lays it out: thickness across the chord, not
    across the camber line, which costs 1.5 % of lift. Source: NACA Reports 460 (1933) and 537 (1935)."""
    if not shape.designation:
        return np.array(shape.coordinates)
    digits = shape.designation
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 121)))
    half = 5.0 * shape.thickness_to_chord
    half = half * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    if len(digits) == 5:
        end, factor = FIVE_DIGIT_LINES[digits[1]]
        front = x**3 - 3.0 * end * x**2 + end**2 * (3.0 - end) * x
        line = factor / 6.0 * np.where(x < end, front, end**3 * (1.0 - x))
    else:
        camber, place = int(digits[0]) / 100.0, int(digits[1]) / 10.0
        rise = 2.0 * place * x - x**2
        front, rear = rise / max(place, 0.1) ** 2, (1.0 - 2.0 * place + rise) / (1.0 - place) ** 2
        line = camber * np.where(x < place, front, rear)
    upper, lower = np.c_[x, line + half], np.c_[x, line - half]
    return np.r_[upper[::-1], lower[1:]]
