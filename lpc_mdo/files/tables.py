"""Tables of numbers as spreadsheets and scripts write them, read within bounds, with the line of every row.

Imports nothing beyond the standard library: the NASTRAN ingest runs under an interpreter of its own.
"""

import csv
import hashlib
import io
import re
from dataclasses import dataclass
from pathlib import Path

from lpc_mdo.files.read import decoded, read_bytes, unzipped

LARGEST_FILE = 64_000_000  # bytes, packed or unpacked: two hundred thousand rows of a hundred columns
MOST_LINES = 1_000_000


@dataclass(frozen=True)
class Table:
    """header: names of the columns; rows: (line number, cells) of every row that is not blank; sha256 of the file."""

    header: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    sha256: str


def read_table(file: Path) -> Table:
    """Rows of a .csv or .csv.gz file.

    Columns are parted by commas; or by semicolons or tabs, as where the decimal mark is a comma, which then is read as a
    point. Blank rows are passed over. Raises ValueError for a file that is too large or damaged, a header that names a
    column twice, and a row of more or fewer cells than the header.
    """
    data = read_bytes(file, LARGEST_FILE)
    text = decoded(unzipped(data, file, LARGEST_FILE) if file.suffix == ".gz" else data, file)
    return parse_table(text, str(file), hashlib.sha256(data).hexdigest())


def parse_table(text: str, name: str, digest: str = "") -> Table:
    """As `read_table`, from text; `name` is for the messages."""
    if text.count("\n") > MOST_LINES:
        raise ValueError(f"{name}: more than {MOST_LINES} lines are invalid: it must have fewer")
    first = next((line for line in text.split("\n") if line.strip()), "")
    mark = next((mark for mark in ";\t" if mark in first and "," not in first), ",")
    reader = csv.reader(io.StringIO(text), delimiter=mark, strict=True)
    header: tuple[str, ...] = ()
    rows = []
    try:
        for cells in reader:
            row = tuple(_cell(cell, mark) for cell in cells)
            if not any(row):
                continue
            if not header:
                header = row
            elif len(row) != len(header):
                hint = "; decimal commas need semicolons between the cells" if len(row) > len(header) else ""
                raise ValueError(
                    f"{name}, line {reader.line_num}: {len(row)} cells are invalid: it must have {len(header)}, as the "
                    f"header{hint}"
                )
            else:
                rows.append((reader.line_num, row))
    except csv.Error as error:
        raise ValueError(f"{name}, line {reader.line_num} is invalid: {error}") from None
    if twice := next((column for column in header if header.count(column) > 1), None):
        raise ValueError(f"{name}: column {twice!r} is invalid: it must stand once in the header")
    return Table(header, tuple(rows), digest)


def _cell(cell: str, mark: str) -> str:
    cell = cell.strip()
    return cell.replace(",", ".") if mark != "," and re.fullmatch(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?", cell) else cell
