"""One turn around a section, cleaned: duplicates, trailing-edge base, sense of rotation, chord, tilt."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

THICKNESS = (0.019, 0.7)  # of the chord
SAME = 1e-7  # chords: points nearer than this are one
LARGEST_TILT = 5.0  # deg that published sections have between their axis and their longest chord line; kept
BASE_FROM = 0.95  # chords: where edges steeper than 45 degrees are the base of a blunt trailing edge
LARGEST_GAP = 0.05  # chords between the ends of an open outline, along the chord
LONGEST_STEP = 0.2  # chords between two points: of 2171 published sections the longest is 0.16
LONGEST_AT_NOSE = 0.1  # likewise from the leading edge to the next point: 0.054
LARGEST_RETURN = 0.05  # chords that a side may run backwards, all steps together
LARGEST_CROSSING = (
    0.005  # chords by which the lower side may lie above the upper one: rounding of cusped trailing edges
)


@dataclass(frozen=True)
class Outline:
    points: np.ndarray
    thickness_to_chord: float
    notes: tuple[str, ...]


def clean_outline(points: np.ndarray, place: str) -> Outline:
    """The outline (point, 2), chord 1, leading edge at the origin, upper side first; `place` names it in messages.

    Points run once around the section, either way, from anywhere. Raises ValueError if they do not, or the section is
    thinner or thicker than `THICKNESS`.
    """
    notes: list[str] = []
    if not np.ptp(points[:, 0]) > 0.0:
        raise ValueError(f"{place}: the x coordinates are invalid: they are all the same")
    opened = _opened(_on_chord_line(points, place, notes), place, notes)
    return Outline(opened, _checked_thickness(opened, place), tuple(notes))


def _on_chord_line(points: np.ndarray, place: str, notes: list[str]) -> np.ndarray:
    """Nose on the left. The file's axes stay what angles of attack are measured from, unless they are turned further
    against the chord line than published sections are."""
    nose, tail = _ends(points, place)
    if tail[0] < nose[0]:
        points, nose, tail = points * (-1.0, 1.0), nose * (-1.0, 1.0), tail * (-1.0, 1.0)
        notes.append("mirrored: its leading edge was on the right")
    tilt = _tilt(nose, tail)
    if abs(tilt) > LARGEST_TILT:
        # The farthest point is one corner of a blunt trailing edge; the chord line ends between both.
        opened = _opened(_turned(points, tilt), place, [])
        tail = 0.5 * (opened[0] + opened[-1])
        tilt += _tilt(opened[np.hypot(*(opened - tail).T).argmax()], tail)
    if abs(tilt) <= LARGEST_TILT:
        return points
    notes.append(f"turned by {-tilt:.2f} degrees onto its chord line")
    return _turned(points, tilt)


def _tilt(nose: np.ndarray, tail: np.ndarray) -> float:
    return float(np.rad2deg(np.arctan2(*(tail - nose)[::-1])))


def _turned(points: np.ndarray, tilt_deg: float) -> np.ndarray:
    cos, sin = np.cos(np.deg2rad(tilt_deg)), np.sin(np.deg2rad(tilt_deg))
    return points @ np.array([[cos, -sin], [sin, cos]])


def _opened(points: np.ndarray, place: str, notes: list[str]) -> np.ndarray:
    """Chord 1, leading edge at the origin, no duplicates, counter-clockwise from the trailing edge."""
    nose = points[points[:, 0].argmin()]
    chord = points[:, 0].max() - nose[0]
    if abs(chord - 1.0) > 1e-3:
        notes.append(f"scaled from a chord of {chord:.6g} to 1")
    if np.hypot(*nose) > 0.01 * chord:
        notes.append(f"leading edge moved from ({nose[0]:.4g}, {nose[1]:.4g}) to the origin")
    points = (points - nose) / chord
    gap = abs(float(points[0, 0] - points[-1, 0]))
    if gap > LARGEST_GAP:
        raise ValueError(
            f"{place}: the points are invalid: they must close at the trailing edge, but the first and the last lie "
            f"{gap:.2g} chords apart"
        )
    is_closed = np.hypot(*(points[0] - points[-1])) <= SAME
    points = _without_duplicates(points, notes)
    if _area(points) < 0.0:
        points = points[::-1]
        notes.append("lower side first: turned around")
    points = _from_trailing_edge(points, is_closed, notes)
    if is_closed and np.hypot(*(points[0] - points[-1])) > SAME:
        notes.append("the repeated point that closed the blunt trailing edge left out")
    return points


def _ends(points: np.ndarray, place: str) -> tuple[np.ndarray, np.ndarray]:
    """Leading and trailing edge (2,): the two points farthest apart, the rounder one the nose; if both are alike, the one
    on the left."""
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:
        raise ValueError(f"{place}: the points are invalid: they lie on one line") from None
    distance = np.hypot(*(hull[:, None] - hull[None]).transpose(2, 0, 1))
    i, j = np.unravel_index(int(distance.argmax()), distance.shape)
    left, right = sorted((hull[i], hull[j]), key=lambda end: end[0])
    if _bulge(points, right, left) > 1.5 * _bulge(points, left, right):
        return right, left
    return left, right


def _bulge(points: np.ndarray, end: np.ndarray, other: np.ndarray) -> float:
    """By how much the section thickens within 5 % of the chord from one end, beyond what the end itself is thick."""
    chord = float(np.hypot(*(other - end)))
    along = (other - end) / chord
    offset = (points - end) / chord
    x, y = offset @ along, offset @ np.array([-along[1], along[0]])
    loop_x, loop_y = np.append(x, x[0]), np.append(y, y[0])
    return _width(loop_x, loop_y, 0.05) - _width(loop_x, loop_y, 1e-3)


def _width(x: np.ndarray, y: np.ndarray, station: float) -> float:
    """Distance between the outermost crossings of a closed polygon (point,) with a station."""
    crosses = np.flatnonzero((x[:-1] < station) != (x[1:] < station))
    if not len(crosses):
        return 0.0
    share = (station - x[crosses]) / (x[crosses + 1] - x[crosses])
    heights = y[crosses] + share * (y[crosses + 1] - y[crosses])
    return float(np.ptp(heights))


def _without_duplicates(points: np.ndarray, notes: list[str]) -> np.ndarray:
    """Points of a closed polygon, none given twice in a row; the last is not the first."""
    keep = np.hypot(*(points - np.roll(points, 1, axis=0)).T) > SAME
    inner = int((~keep[1:]).sum())
    if inner:
        notes.append(f"{inner} repeated point{'s' if inner > 1 else ''} left out")
    return points[keep] if keep.any() else points


def _from_trailing_edge(points: np.ndarray, is_closed: bool, notes: list[str]) -> np.ndarray:
    """A counter-clockwise closed polygon (point, 2), opened at its trailing edge without the points of a blunt base."""
    lower, upper = _base(points, is_closed)
    points = np.roll(points, -(upper % len(points)), axis=0)
    inside = upper - lower - 1
    if inside < 0:
        return np.concatenate([points, points[:1]])
    if inside:
        notes.append(f"{inside} point{'s' if inside > 1 else ''} on the base of the blunt trailing edge left out")
    return points[: len(points) - inside]


def _base(points: np.ndarray, is_closed: bool) -> tuple[int, int]:
    """Numbers of the first and last point of the base of the trailing edge, cyclic; the same twice where it is sharp.

    A base is a straight line steeper than 45 degrees at the rear end; of a rounded end it is what the file left open.
    """
    count, x = len(points), points[:, 0]
    steps = np.roll(points, -1, axis=0) - points
    is_steep = (np.abs(steps[:, 1]) > np.abs(steps[:, 0])) & (np.minimum(x, np.roll(x, -1)) > BASE_FROM)
    last = int(x.argmax())
    lower = upper = last
    while upper - last < count and is_steep[upper % count]:
        upper += 1
    while upper - lower < count and is_steep[(lower - 1) % count]:
        lower -= 1
    if upper == lower or _is_straight(points, lower, upper):
        return lower, upper
    return (count - 1, count) if is_steep[-1] and not is_closed else (last, last)


def _is_straight(points: np.ndarray, lower: int, upper: int) -> bool:
    """Between the two corners no point lies further off their line than a tenth of its length."""
    base = points[np.arange(lower, upper + 1) % len(points)]
    along = base[-1] - base[0]
    length = float(np.hypot(*along))
    off = np.abs((base - base[0]) @ np.array([-along[1], along[0]]))
    return length > 0.0 and float(off.max()) <= 0.1 * length**2


def _checked_thickness(points: np.ndarray, place: str) -> float:
    """Largest thickness in chords. Raises ValueError if the points are no turn from the trailing edge and back."""
    front = int(points[:, 0].argmin())
    upper, lower = points[front::-1], points[front:]
    returns = [float(-np.minimum(np.diff(side[:, 0]), 0.0).sum()) for side in (upper, lower)]
    if min(len(upper), len(lower)) < 4 or max(returns) > LARGEST_RETURN:
        raise ValueError(
            f"{place}: the order of points is invalid: it must run once around the section, or along both sides"
        )
    _require_no_hole(points, front, place)
    stations = np.linspace(0.0, 1.0, 401)
    sides = [np.interp(stations, np.maximum.accumulate(side[:, 0]), side[:, 1]) for side in (upper, lower)]
    depth = (sides[0] - sides[1])[4:-1]
    if depth.min() < -LARGEST_CROSSING:
        at = stations[4:-1][int(depth.argmin())]
        raise ValueError(
            f"{place}: the points are invalid: the lower side lies above the upper one at x = {at:.2f} chords"
        )
    thickness = float(depth.max())
    if not THICKNESS[0] <= thickness <= THICKNESS[1]:
        raise ValueError(
            f"{place}: a thickness of {thickness:.3g} chords is invalid: it must lie between {THICKNESS[0]} and "
            f"{THICKNESS[1]}"
        )
    return thickness


def _require_no_hole(points: np.ndarray, front: int, place: str) -> None:
    """Raises ValueError where so long a piece of the outline has no points that its shape would be a guess."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    for k, longest in ((int(steps.argmax()), LONGEST_STEP), *((k, LONGEST_AT_NOSE) for k in (front - 1, front))):
        if 0 <= k < len(steps) and steps[k] > longest:
            (x1, y1), (x2, y2) = points[k], points[k + 1]
            raise ValueError(
                f"{place}: the points are invalid: between ({x1:.3g}, {y1:.3g}) and ({x2:.3g}, {y2:.3g}) chords there must "
                f"be more: {steps[k]:.2g} chords without one, at most {longest:g}"
                f"{' at the leading edge' if longest == LONGEST_AT_NOSE else ''}"
            )


def _area(points: np.ndarray) -> float:
    """Signed area; positive where points run counter-clockwise, upper side first."""
    x, y = points.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
