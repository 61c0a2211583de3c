"""Airfoil coordinate files as people have them: read whole, cleaned, and what was done is said.

Read are Selig's order (around the section) and Lednicer's (two sides), with or without title, point counts, headings and
notes, in any unit and encoding, with decimal points or commas. Nothing is guessed silently: `AirfoilSection.notes` holds a
sentence on everything that was changed, and a file that stays ambiguous is refused.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lpc_mdo.airfoils.outline import Outline, clean_outline
from lpc_mdo.files.read import read_bytes

LARGEST_FILE = 1_000_000  # bytes
FEWEST_POINTS, MOST_POINTS = 20, 10_000
FEWEST_OF_A_SIDE = 5
COMMENT = ("#", "!", "%", "//", '"', "'")
NUMBER = r"[+-]?(?:\d+{mark}?\d*|{mark}\d+)(?:[eEdD][+-]?\d+)?"
WITH_POINT = re.compile(NUMBER.format(mark=r"\."))
WITH_COMMA = re.compile(NUMBER.format(mark=","))
ENCODING_MARKS = ((b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"), (b"\xef\xbb\xbf", "utf-8-sig"))


@dataclass(frozen=True)
class AirfoilSection:
    """One section. points (point, 2): x and y in chords, leading edge at the origin, from the upper corner of the trailing
    edge over the upper side around to the lower corner; a sharp trailing edge is the first and the last point. title: the
    file's own; notes: a sentence each on what was changed, and on the order that was found."""

    title: str
    points: np.ndarray
    thickness_to_chord: float
    notes: tuple[str, ...]


def read_airfoil_file(file: Path) -> AirfoilSection:
    """The section of a coordinate file.

    Raises ValueError, with the file, the line where there is one, and the rule, if it holds no section.
    """
    text = _text(file)
    title, rows, notes = _rows(text, str(file))
    points, order = _ordered(rows, str(file), notes)
    outline: Outline = clean_outline(points, str(file))
    return AirfoilSection(title, outline.points, outline.thickness_to_chord, (order, *notes, *outline.notes))


def _text(file: Path) -> str:
    data = read_bytes(file, LARGEST_FILE)
    encoding = next((name for mark, name in ENCODING_MARKS if data.startswith(mark)), "utf-8")
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        return data.decode("latin-1")  # a title or note in some older alphabet; numbers are the same in all of them


def _rows(text: str, place: str) -> tuple[str, np.ndarray, list[str]]:
    """Title, pairs (row, 2) of numbers, and notes. Raises ValueError for a line that is neither numbers nor words."""
    lines = [line.strip().replace("\u2212", "-") for line in re.split(r"\r\n|\r|\n", text)]
    has_commas = sum(_numbers(line, True) is not None for line in lines) > sum(
        _numbers(line, False) is not None for line in lines
    )
    found = {k: numbers for k, line in enumerate(lines) if (numbers := _numbers(line, has_commas)) is not None}
    found = _without_numbers_of_notes(lines, found)
    if len(found) < FEWEST_POINTS:
        _refuse_damaged_line(lines, range(min(found, default=0), len(lines)), found, has_commas, place)
        raise ValueError(f"{place}: {len(found)} points are invalid: there must be {FEWEST_POINTS} to {MOST_POINTS}")
    first, last = min(found), max(found)
    _refuse_damaged_line(lines, range(len(lines)), found, has_commas, place)
    notes = ["decimal commas were read as decimal points"] if has_commas else []
    if ignored := [lines[k] for k in range(last + 1, len(lines)) if lines[k]]:
        notes.append(f"{_count(ignored, 'line')} of text after the points left out")
    if ignored := [lines[k] for k in range(first, last) if k not in found and lines[k]]:
        notes.append(f"{_count(ignored, 'line')} of text between the points left out")
    title = next((line for line in lines[:first] if line), "")
    return title, _two_columns(list(found.values()), place, notes), notes


def _without_numbers_of_notes(lines: list[str], found: dict[int, tuple[float, ...]]) -> dict[int, tuple[float, ...]]:
    """Rows without those after the last words, where they are too few for a side: a note may hold numbers."""
    words = [k for k in range(min(found, default=0), max(found, default=0)) if lines[k] and k not in found]
    words = [k for k in words if not lines[k].startswith(COMMENT)]
    if words and sum(k > words[-1] for k in found) < FEWEST_OF_A_SIDE:
        return _without_numbers_of_notes(lines, {k: row for k, row in found.items() if k < words[-1]})
    return found


def _numbers(line: str, has_commas: bool) -> tuple[float, ...] | None:
    """The two or three numbers of a line, or None."""
    cells = re.split(r"[\s;]+", line.strip("; \t")) if has_commas else re.split(r"[\s;,]+", line.strip(",; \t"))
    pattern = WITH_COMMA if has_commas else WITH_POINT
    if len(cells) not in (2, 3) or not all(pattern.fullmatch(cell) for cell in cells):
        return None
    return tuple(float(re.sub("[dD]", "e", cell.replace(",", "."))) for cell in cells)


def _refuse_damaged_line(
    lines: list[str], where: range, found: Mapping[int, tuple[float, ...]], has_commas: bool, place: str
) -> None:
    """Raises ValueError for a line that looks like a damaged pair: words may be skipped, points may not.

    Between the points that is one that begins with a number or holds a decimal; after them, one that follows at once; before
    them, one of two words that begin like numbers, one of which is a number such as a coordinate is.
    """
    pattern = WITH_COMMA if has_commas else WITH_POINT
    first, last = min(found, default=-1), max(found, default=len(lines))
    for k in where:
        if k in found or not lines[k] or lines[k].startswith(COMMENT):
            continue
        cells = re.split(r"[\s;]+" if has_commas else r"[\s;,]+", lines[k])
        is_number = [bool(pattern.fullmatch(cell)) for cell in cells]
        decimals = any(n and re.search("[.,]", cell) for n, cell in zip(is_number, cells, strict=True))
        is_short = len(cells) == 1 or (len(cells) == 2 and decimals) or all(map(_is_numeric_start, cells))
        if k < first:
            is_damaged = len(cells) == 2 and decimals and all(map(_is_numeric_start, cells))
        else:
            is_damaged = (is_number[0] or decimals) if k < last else (is_number[0] and is_short)
        if is_damaged:
            raise ValueError(f"{place}: {lines[k][:40]!r} is invalid: it must be two finite numbers (line {k + 1})")
        if k > last:
            return


def _is_numeric_start(cell: str) -> bool:
    return bool(re.match(r"[+-]?[.,]?\d", cell))


def _two_columns(rows: list[tuple[float, ...]], place: str, notes: list[str]) -> np.ndarray:
    """Pairs (row, 2); of triples, which drawing programs write, the column that never changes is left out."""
    pairs = [row for row in rows if len(row) == 2]
    if len(pairs) == len(rows):
        values = np.array(pairs)
    elif pairs and len(rows) - len(pairs) > 0:
        odd = next(row for row in rows if len(row) == 3)
        raise ValueError(f"{place}: {odd} is invalid: every point must be two finite numbers")
    else:
        values = np.array(rows)
        constant = [k for k in range(3) if np.ptp(values[:, k]) == 0.0]
        if len(constant) != 1:
            raise ValueError(f"{place}: three columns are invalid: every point must be two finite numbers")
        values = np.delete(values, constant[0], axis=1)
        notes.append(f"column {constant[0] + 1} of three, which never changes, left out")
    if not np.isfinite(values).all():
        raise ValueError(f"{place}: a number above 1e308 is invalid: every point must be two finite numbers")
    return values


def _ordered(rows: np.ndarray, place: str, notes: list[str]) -> tuple[np.ndarray, str]:
    """Points (point, 2) in one turn around the section, and the order in which the file had them.

    A first pair may be Lednicer's point counts, or a title such as '63 415'.
    """
    rows = _without_title(rows, notes)
    counts, points = rows[0], rows[1:]
    if _are_counts(counts) and counts.sum() == len(points):
        start = int(counts[0])
        return _joined(points[:start], points[start:]), f"Lednicer's order, {start} + {len(points) - start} points"
    is_outside = _is_apart(counts, points)
    points = points if is_outside else rows
    if not FEWEST_POINTS <= len(points) <= MOST_POINTS:
        raise ValueError(f"{place}: {len(points)} points are invalid: there must be {FEWEST_POINTS} to {MOST_POINTS}")
    start = _second_side(points)
    if start and is_outside and _are_counts(counts):
        raise ValueError(f"{place}: {len(points)} points are invalid: its header says {counts[0]:g} + {counts[1]:g}")
    if is_outside:
        notes.append(f"'{counts[0]:g} {counts[1]:g}' before the points read as a title")
    if start:
        order = f"two sides without point counts, {start} + {len(points) - start} points"
        return _joined(points[:start], points[start:]), order
    return points, f"Selig's order, {len(points)} points"


def _without_title(rows: np.ndarray, notes: list[str]) -> np.ndarray:
    """Rows without a title of two numbers that stands before point counts."""
    if _are_counts(rows[1]) and rows[1].sum() == len(rows) - 2 and _is_apart(rows[0], rows[2:]):
        notes.append(f"'{rows[0, 0]:g} {rows[0, 1]:g}' before the points read as a title")
        return rows[1:]
    return rows


def _are_counts(pair: np.ndarray) -> bool:
    return bool((pair >= FEWEST_OF_A_SIDE).all() and (pair == pair.round()).all())


def _is_apart(pair: np.ndarray, points: np.ndarray) -> bool:
    """The pair is no point of the section: far outside its extent, or far from where the others begin and end."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    size = float(np.hypot(*(upper - lower)))
    outside = np.maximum(np.maximum(lower - pair, pair - upper), 0.0)
    is_closed = np.hypot(*(points[0] - points[-1])) < 0.1 * size
    return bool(np.hypot(*outside) > 0.5 * size or (is_closed and np.hypot(*(pair - points[0])) > 0.2 * size))


def _second_side(points: np.ndarray) -> int:
    """Where the second of two sides begins: after the one step that leads from one end of the section to the other."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    extent = np.ptp(points, axis=0).max()
    k = int(steps.argmax())
    is_between = min(k + 1, len(points) - k - 1) >= FEWEST_OF_A_SIDE
    return k + 1 if is_between and steps[k] > 0.8 * extent else 0


def _joined(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """One turn from two sides that both begin at the leading edge or both at the trailing edge, which they may share."""
    return np.concatenate([first[::-1], second[1:] if (first[0] == second[0]).all() else second])


def _count(things: list[str], name: str) -> str:
    return f"{len(things)} {name}" + ("s" if len(things) != 1 else "")
