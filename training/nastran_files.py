"""What NASTRAN leaves behind, as text: bulk data with their includes, and how a design run ended."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from lpc_mdo.files.read import read_bytes

LARGEST_FILE = 64_000_000  # bytes
DEEPEST_INCLUDE = 8
MOST_INCLUDED = 200  # files in one deck
LARGEST_VIOLATION = 0.005  # what NASTRAN itself counts as satisfied (GMAX of DOPTPRM)
ENDED = re.compile(r"RUN\s+TERMINATED\s+DUE\s+TO\s+(HARD|SOFT|[^\n]*)")
ACHIEVED = re.compile(r"(HARD|SOFT)\s+CONVERGENCE\s+ACHIEVED")  # in the summary, where there is no message on the end


@dataclass(frozen=True)
class Run:
    """What the printed output says; violation is NaN where it holds no history; reason: why it failed, or empty."""

    status: str
    violation: float
    cycles: float
    reason: str = ""


def read_run(file: Path) -> Run:
    """Convergence, largest constraint of the last design cycle and number of cycles from an F06 file.

    A run counts where NASTRAN ended it because it had converged; not where a cycle merely names the test ("convergence not
    achieved yet (hard convergence decision logic)"), nor after a fatal message.
    """
    if not file.is_file():
        return Run("failed", float("nan"), 0.0, f"there is no {file.name}")
    text = _text(file).upper()
    _, _, history = text.rpartition("OBJECTIVE AND MAXIMUM CONSTRAINT HISTORY")
    rows = re.findall(r"^\s*(?:INITIAL|\d+)\s[\s\d.E+-]*?([+-]?\d+\.\d*E[+-]\d+)\s*$", history, re.MULTILINE)
    violation, cycles = max(0.0, float(rows[-1])) if rows else float("nan"), float(max(len(rows) - 1, 0))
    ends = ENDED.findall(text) or ACHIEVED.findall(text)
    status = {"HARD": "converged", "SOFT": "soft"}.get(ends[-1] if ends else "", "failed")
    if re.search(r"\*\*\*\s*(?:USER|SYSTEM)\s+FATAL", text):
        return Run("failed", violation, cycles, "NASTRAN stopped with a fatal message")
    if status == "failed":
        why = f"ended by {' '.join(ends[-1].split()).lower()}" if ends else "nothing says that it converged"
        return Run(status, violation, cycles, f"not converged: {why}")
    if not rows:
        return Run("failed", violation, cycles, "it holds no history of the largest constraint")
    if not violation <= LARGEST_VIOLATION:
        return Run("failed", violation, cycles, f"constraints violated by {violation:.2g}")
    return Run(status, violation, cycles)


def bulk_text(file: Path, folder: Path) -> str:
    """Text of a deck with what it includes in place, all of which must lie in `folder`.

    Raises ValueError for an include from elsewhere, one that is missing, for too many or too deep ones, and for a deck that
    was cut short.
    """
    count = 0

    def expanded(part: Path, depth: int) -> str:
        nonlocal count
        count += 1
        if depth > DEEPEST_INCLUDE or count > MOST_INCLUDED:
            raise ValueError(
                f"{part.name}: more than {DEEPEST_INCLUDE} nested or {MOST_INCLUDED} included files are invalid"
            )
        lines, done = iter(_text(part).splitlines()), []
        for line in lines:
            if line.lstrip().upper().startswith("INCLUDE"):
                name = _included_name(line, lines, part)
                done.append(expanded(_within(name, part, folder), depth + 1))
            else:
                done.append(line)
        return "\n".join(done)

    whole = expanded(file, 0)
    # Punched bulk data may come without delimiters; a deck that begins has an end, or it was cut short.
    if re.search(r"^BEGIN\s+BULK", whole, re.IGNORECASE | re.MULTILINE) and not re.search(
        r"^ENDDATA", whole, re.IGNORECASE | re.MULTILINE
    ):
        raise ValueError(f"{file.name}: ENDDATA is missing: the deck must be whole")
    return whole


def _included_name(line: str, lines: Iterator[str], part: Path) -> str:
    """Name in an INCLUDE statement, which may go on over lines until its quote closes."""
    rest = line.lstrip()[len("INCLUDE") :].strip().removeprefix("=").strip()
    if rest[:1] not in ("'", '"') or not rest:
        return rest.split("$")[0].strip()
    quote, rest = rest[0], rest[1:]
    for _ in range(10):
        if quote in rest:
            return rest.split(quote)[0]
        rest += next(lines, quote).strip()
    raise ValueError(f"{part.name}: {line.strip()[:40]!r} is invalid: its quote must close")


def _within(name: str, part: Path, folder: Path) -> Path:
    for base in (part.parent, folder):
        found = (base / name).resolve()
        if not found.is_relative_to(folder.resolve()):
            raise ValueError(f"{part.name}: INCLUDE {name!r} is invalid: it must lie in {folder}")
        if found.is_file():
            return found
    raise ValueError(f"{part.name}: INCLUDE {name!r} is invalid: there is no such file in {folder}")


def _text(file: Path) -> str:
    return read_bytes(file, LARGEST_FILE).decode("ascii", errors="replace")
