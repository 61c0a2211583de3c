"""Sections as XFOIL takes them: NACA four- and five-digit designations, and coordinate files."""

import hashlib
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lpc_mdo.airfoils.coordinate_file import read_airfoil_file
from lpc_mdo.airfoils.sections import SHIPPED
from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import is_there

SENT_POINTS = 300  # to XFOIL, which holds some 600
LONGEST_NAME = 200  # bytes, to which endings are added: file systems hold 255
THICKNESS = (0.03, 0.4)  # of the chord, of NACA sections


@dataclass(frozen=True)
class AirfoilShape:
    """designation: the digits of a NACA section, or empty where coordinates (point, 2) describe it: x from the leading
    edge in chords, from the trailing edge over the upper side around to the trailing edge. notes: what reading them changed."""

    name: str
    thickness_to_chord: float
    designation: str = ""
    coordinates: tuple[tuple[float, float], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Tells two sections of one name apart."""
        return hashlib.sha256(repr((self.designation, self.coordinates)).encode()).hexdigest()[:12]


def airfoil_shape(name_or_file: str) -> AirfoilShape:
    """A section from 'naca4412', '4412', 'naca 23012', the path of a coordinate file, or the name of a shipped one.

    Raises ValueError that names what is wrong.
    """
    if match := re.fullmatch(r"(?:naca)?[ -]?(\d{4,5})", name_or_file.strip().lower()):
        return _naca(match[1])
    file, shipped = Path(name_or_file), SHIPPED / f"{name_or_file.lower()}.dat"
    if not is_there(file) and file.name == name_or_file and is_there(shipped):
        file = shipped
    if not is_there(file):
        raise ValueError(
            f"airfoil = {shortened(name_or_file)} is invalid: it must be a NACA section of four or five digits or a coordinate file"
        )
    return _from_file(file)


def _stem(file: Path) -> str:
    """The file's name without its ending, in any alphabet; what a name of files cannot hold everywhere becomes '_'."""
    stem = unicodedata.normalize("NFC", file.stem).lower()
    name = re.sub(r"[^\w.-]+", "_", stem).strip("._-")
    if not name:
        raise ValueError(f"{file} is invalid: its name must hold a letter or digit to name the section by")
    while len(name.encode()) > LONGEST_NAME:
        name = name[:-1]
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


def _from_file(file: Path) -> AirfoilShape:
    section = read_airfoil_file(file)
    points, notes = section.points, list(section.notes)
    if len(points) > SENT_POINTS:
        front = int(points[:, 0].argmin())
        kept = np.r_[np.linspace(0, len(points) - 1, SENT_POINTS - 1).round().astype(int), front]
        points = points[np.unique(kept)]
        notes.append(f"{len(points)} of {len(section.points)} points kept for XFOIL")
    rows: Sequence[Sequence[float]] = points.round(7).tolist()
    coordinates = tuple((x, y) for x, y in rows)
    return AirfoilShape(_stem(file), section.thickness_to_chord, coordinates=coordinates, notes=tuple(notes))


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
    half = (
        5.0
        * shape.thickness_to_chord
        * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    )
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
