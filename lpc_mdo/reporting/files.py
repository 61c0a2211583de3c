"""Writing files so that a killed run leaves none half written."""

import os
from pathlib import Path


def write_atomically(file: Path, text: str) -> None:
    """Write a whole file or none of it."""
    partial = file.with_name(file.name + ".partial")
    with partial.open("w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(partial, file)
