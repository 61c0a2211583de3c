"""Writing files so that a killed run, or a full disk, leaves none half written."""

import os
from collections.abc import Mapping
from pathlib import Path


def write_atomically(file: Path, text: str) -> None:
    """Write a whole file or none of it."""
    write_together({file: text.encode()})


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together, each whole: all are on the disk before the first takes its name.

    Raises OSError, with nothing left behind, if one cannot be written.
    """
    partial = {file: file.with_name(file.name + ".partial") for file in contents}
    try:
        for file, data in contents.items():
            with partial[file].open("wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
        for file in contents:
            os.replace(partial[file], file)
    finally:
        for file in partial.values():
            file.unlink(missing_ok=True)
