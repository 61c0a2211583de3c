"""Polars as XFOIL saves them (PACC), and as XFLR5 and airfoil collections on the web copy the form."""

import hashlib
import re
from pathlib import Path

from lpc_mdo.files.read import decoded, read_bytes

LARGEST_FILE = 10_000_000  # bytes
CONDITIONS = re.compile(r"Mach\s*=\s*(\S+)\s+Re\s*=\s*(\S+)\s*e\s*([+-]?\d+)", re.IGNORECASE)
KIND = re.compile(r"^\s*(\d)\s+(\d)\s+Reynolds", re.MULTILINE)
COLUMNS = ("alpha", "cl", "cd")
Row = tuple[int, tuple[str, str, str, str, str]]


def is_saved_polar(file: Path) -> bool:
    """Whether the beginning of the file is that of a polar of XFOIL."""
    if file.suffix == ".gz" or not file.is_file():
        return False
    with file.open("rb") as stream:
        start = stream.read(2000).decode("utf-8", errors="replace")
    return CONDITIONS.search(start) is not None


def read_saved_polar(file: Path) -> tuple[list[Row], str]:
    """(line number, (Reynolds number, Mach number, alpha_deg, cl, cd) as text) of every point, and the file's sha256.

    Several polars may stand in one file. Raises ValueError if it is none, if its Reynolds or Mach number changes with lift
    (types 2 and 3 of XFOIL), if it has no points, and for a row that is no numbers.
    """
    data = read_bytes(file, LARGEST_FILE)
    text = decoded(data, file)
    if not CONDITIONS.search(text):
        raise ValueError(f"{file} is invalid: it must be a polar that XFOIL saved, with a line 'Mach = ... Re = ...'")
    if any(kind != ("1", "1") for kind in KIND.findall(text)):
        raise ValueError(f"{file} is invalid: it must be of type 1, at one Reynolds and one Mach number")
    conditions = ("", "")
    rows: list[Row] = []
    columns: list[str] = []
    for number, line in enumerate(text.split("\n"), start=1):
        cells = line.split()
        if found := CONDITIONS.search(line):
            mach, mantissa, exponent = found.groups()
            conditions, columns = (f"{mantissa}e{exponent}", mach), []
        elif cells and [cell.lower() for cell in cells[:3]] == list(COLUMNS):
            columns = cells
        elif cells and not re.match(r"[+-]?\.?\d", cells[0]):
            columns = columns if set(line) <= set(" -\t") else []  # a rule under the header, or the next polar
        elif columns and cells:
            if len(cells) < len(COLUMNS):
                raise ValueError(
                    f"{file}, line {number}: {line.strip()[:40]!r} is invalid: it must be a row of the polar"
                )
            alpha, cl, cd = cells[:3]
            rows.append((number, (*conditions, alpha, cl, cd)))
    if not rows:
        raise ValueError(f"{file} is invalid: it must have rows of numbers under a header 'alpha CL CD'")
    return rows, hashlib.sha256(data).hexdigest()
