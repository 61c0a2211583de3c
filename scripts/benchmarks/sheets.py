"""Tables of a benchmark: on the terminal and in a Markdown page."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rich.markup import escape
from rich.table import Table

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


@dataclass(frozen=True)
class Sheet:
    """A titled table; notes stand below it."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Target:
    """A promise and what was measured of it; None where it could not be measured."""

    promise: str
    measured: str
    is_met: bool | None


@dataclass(frozen=True)
class Section:
    sheets: tuple[Sheet, ...]
    targets: tuple[Target, ...] = field(default=())


def targets_sheet(targets: Sequence[Target]) -> Sheet:
    words = {True: "yes", False: "no", None: "not measured"}
    return Sheet(
        "Targets",
        ("target", "measured", "met"),
        tuple((target.promise, target.measured, words[target.is_met]) for target in targets),
    )


def printed(sheet: Sheet) -> Table:
    table = Table(*map(escape, sheet.columns), title=sheet.title, caption=escape("\n".join(sheet.notes)))
    table.title_justify = table.caption_justify = "left"
    for row in sheet.rows:
        table.add_row(*map(escape, row))
    return table


def markdown(sheet: Sheet) -> str:
    rows = [sheet.columns, ("---",) * len(sheet.columns), *sheet.rows]
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    notes = [f"\n{note}" for note in sheet.notes]
    return "\n".join([f"### {sheet.title}", "", *lines, *notes]) + "\n"


def write_markdown(file: Path, header: str, sheets: Sequence[Sheet]) -> None:
    """Put the tables between the page's two marks, or make a page of them where there is none.

    Raises ValueError for a file that lacks the marks.
    """
    body = "\n".join([BEGIN, header, "", *(markdown(sheet) for sheet in sheets), END])
    if not file.exists():
        file.write_text(f"{body}\n", encoding="utf-8")
        return
    text = file.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(END) < text.index(BEGIN):
        raise ValueError(f"--markdown {file} is not allowed; it must have one line {BEGIN} and, below, one {END}")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    file.write_text(before + body + after, encoding="utf-8")
