"""starts.json, schema lpc-mdo/starts/2: what scattered starts say together, beside the run folder of the best of them."""

from pathlib import Path
from typing import Any

from lpc_mdo.files.values import Count, Name, NotNegative, Number, Stored, Text, read_table, validated

SCHEMA = "lpc-mdo/starts/2"
FILE = "starts.json"


class Widest(Stored):
    name: Name
    unit: Text
    here: Number
    there: Number
    share: NotNegative


class Free(Stored):
    name: Name
    free: Count
    of: Count
    widest: Widest


class Flatness(Stored):
    starts: Count
    directions: Count | None
    largest: NotNegative | None
    free: tuple[Free, ...]


class Starts(Stored):
    """What the report tells of it."""

    count: Count
    converged: Count
    verdict: Text
    flatness: Flatness


def read_starts(file: Path) -> dict[str, Any]:
    """Content of starts.json. Raises ConfigurationError where it is damaged."""
    content = read_table(file, SCHEMA)
    validated(Starts, content, file)
    return content
